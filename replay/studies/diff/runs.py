"""Compares two run folders: episodes gained, lost and shifted, the ratio of times, and every setting that differs."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from replay.auditing.matching import partners
from replay.auditing.outcome import Episode
from replay.document.coding import plain_of
from replay.document.ranking import Range, count_range
from replay.document.run_document import RunDocument
from replay.errors import RunFolderError
from replay.show.results.run_folder import read_run_folder

TICKS: Final = 1_000_000
"""Episodes are compared in microseconds: seconds of a session are whole nanoseconds rounded to float64."""

SETTINGS: Final = ("seed", "window", "oracle", "versions", "machine")
"""Parts of a summary that say how a run was made, besides the settings of its detectors and its session."""

Row = Mapping[str, Any]

Fractions = tuple[float | None, ...]
Ranges = tuple[Range | None, ...]
"""In the first and in the second run."""


@dataclass(frozen=True)
class Shift:
    """A contact of both runs, as its rows in their tables, and the seconds by which it begins and ends later."""

    before: Row
    after: Row
    start: float
    end: float


@dataclass(frozen=True)
class DetectorDiff:
    """One detector in two runs.

    ``same`` counts contacts that begin and end at the same time in both, ``shifted`` are those that moved, ``gained``
    and ``lost`` rows of contacts that only the second, or only the first, run has. Ratios are seconds of the second
    over those of the first, ``None`` where one was not measured. ``same_verdicts``: whether the digests are equal,
    ``None`` where one has none. ``missed`` are contacts never found in the first and in the second, the smallest and
    the largest count over the sampling offsets; ``false_contact`` the parts of the time reported
    that are false, means over these offsets: both as the ranking of each run says them, ``None`` where the detector was
    not audited.
    """

    same: int
    gained: tuple[Row, ...]
    lost: tuple[Row, ...]
    shifted: tuple[Shift, ...]
    time_ratio: float | None
    p99_ratio: float | None
    same_verdicts: bool | None
    missed: Ranges
    false_contact: Fractions

    @property
    def changed(self) -> bool:
        """Whether any contact was gained, lost or shifted."""
        return bool(self.gained or self.lost or self.shifted)


@dataclass(frozen=True)
class RunDiff:
    """Two runs beside each other: label -> comparison of the detectors that both have, and the labels of the others.

    ``settings`` is name -> (first, second) of everything set differently.
    """

    detectors: Mapping[str, DetectorDiff]
    only_a: tuple[str, ...]
    only_b: tuple[str, ...]
    settings: Mapping[str, tuple[Any, Any]]

    @property
    def changed(self) -> bool:
        """Whether any contact was gained, lost or shifted."""
        return any(detector.changed for detector in self.detectors.values())


def diff_runs(a: str | Path, b: str | Path, *, different_sessions: bool = False) -> RunDiff:
    """Compare two run folders.

    Raises ``RunFolderError``: a folder that is none, or of another version; two recordings, unless they are meant to be
    ``different_sessions``.
    """
    runs = [read_run_folder(run) for run in (a, b)]
    for run in runs:
        if run.has_picture:
            _ = run.picture  # refused where it is not the one that the run wrote
    sessions = [run.document.session for run in runs]
    if len({session.digest for session in sessions} - {None}) > 1 and not different_sessions:
        names = " and ".join(session.id for session in sessions)
        raise RunFolderError(
            f"{a} and {b} replay different recordings, {names}: their contacts do not compare; "
            "if that is meant, add --different-sessions"
        )
    labels = [run.document.detectors for run in runs]
    episodes = [run.rows("episodes") for run in runs]
    common = [label for label in labels[0] if label in labels[1]]
    only_a, only_b = (tuple(label for label in own if label not in common) for own in labels)
    return RunDiff(
        {label: _detector(label, [run.document for run in runs], episodes) for label in common},
        only_a,
        only_b,
        dict(_differences(runs[0].document, runs[1].document, common)),
    )


def _detector(label: str, documents: Sequence[RunDocument], episodes: Sequence[Sequence[Row]]) -> DetectorDiff:
    """One detector, by the documents of both runs and their tables of contacts."""
    detectors = [document.detectors[label] for document in documents]
    before, after = ([row for row in rows if row["detector"] == label] for rows in episodes)
    number = {name: k for k, name in enumerate(dict.fromkeys(map(_pair, (*before, *after))))}
    matched = partners(*([_episode(number[_pair(row)], row) for row in rows] for rows in (before, after)))
    both = [(before[i - 1], after[j - 1]) for i, j in matched]
    shifts = [Shift(old, new, new["start"] - old["start"], new["end"] - old["end"]) for old, new in both]
    moved = tuple(shift for shift in shifts if round(shift.start * TICKS) or round(shift.end * TICKS))
    kept, come = {i for i, _ in matched}, {j for _, j in matched}
    seconds, digests = [detector.seconds for detector in detectors], [detector.digest for detector in detectors]
    audits = [document.audit.get(label) for document in documents]
    missed = tuple(
        None if audit is None else count_range(audit.counts_over_offsets.contacts_missed) for audit in audits
    )
    false = tuple(None if audit is None else audit.false_contact_mean.value for audit in audits)
    return DetectorDiff(
        same=len(shifts) - len(moved), gained=tuple(row for k, row in enumerate(after, 1) if k not in come),
        lost=tuple(row for k, row in enumerate(before, 1) if k not in kept), shifted=moved,
        time_ratio=_ratio(*(times.detect for times in seconds)),
        p99_ratio=_ratio(*(times.p99 for times in seconds)),
        same_verdicts=None if None in digests else digests[0] == digests[1],
        missed=missed, false_contact=false,
    )  # fmt: skip


def _episode(pair: int, row: Row) -> Episode:
    start, end = row["start"], row["end"]
    # A contact is over at its end: one that begins there does not overlap it.
    first = round(start * TICKS)
    return Episode(pair, first, max(first, round(end * TICKS) - 1), start, end)


def _pair(row: Row) -> tuple[str, str]:
    a, b = sorted((row["body_a"], row["body_b"]))
    return a, b


def _ratio(before: float | None, after: float | None) -> float | None:
    return after / before if before and after is not None else None


def _differences(
    first: RunDocument, second: RunDocument, common: Sequence[str]
) -> Iterator[tuple[str, tuple[Any, Any]]]:
    a, b = plain_of(first), plain_of(second)
    for name in SETTINGS:
        yield from _unequal(name, a[name], b[name])
    # what was said of a pair's containment is an answer, not a setting
    yield from _unequal("pairs", *([(pair.name, pair.grasp) for pair in run.pairs] for run in (first, second)))
    for name in ("frames", "bodies"):
        yield from _unequal(f"session.{name}", a["session"][name], b["session"][name])
    for label in common:
        for key in ("name", "settings"):
            yield from _unequal(f"{label}.{key}", a["detectors"][label][key], b["detectors"][label][key])


def _unequal(name: str, a: Any, b: Any) -> Iterator[tuple[str, tuple[Any, Any]]]:
    """Leaves that differ, with their path."""
    if isinstance(a, Mapping) and isinstance(b, Mapping):
        for key in dict.fromkeys([*a, *b]):
            yield from _unequal(f"{name}.{key}", a.get(key), b.get(key))
    elif a != b:
        yield name, (a, b)
