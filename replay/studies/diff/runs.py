"""Compares two run folders: episodes gained, lost and shifted, the ratio of times, and every setting that differs.

Detectors of one label are compared with each other. A label that only one run has is compared with one of the other run
that stands for the same: hulls of the first with the shipped colliders of the second.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from replay.auditing.matching import matching_numbers
from replay.auditing.outcome import Episode
from replay.document.coding import plain_of
from replay.document.contact import ContactRecord
from replay.document.ranking import CountBounds, Rank, count_range
from replay.document.run_document import RunDocument
from replay.errors import RunFolderError
from replay.show.results.run_folder import RunFolder, read_run_folder
from replay.studies.diff.answer import answer_of
from replay.studies.diff.counterparts import Labels, matching_labels

TICKS_PER_SECOND: Final = 1_000_000
"""Episodes are compared in microseconds: seconds of a session are whole nanoseconds rounded to float64."""

SETTING_KEYS: Final = ("seed", "tau", "window", "oracle", "versions", "machine")
"""Parts of a summary that say how a run was made, besides the settings of its detectors and its session."""

Fractions = tuple[float | None, ...]
CountBoundsPair = tuple[CountBounds | None, ...]
"""In the first and in the second run."""


@dataclass(frozen=True)
class Shift:
    """A contact of both runs, as each has it, and the seconds by which it begins and ends later."""

    before: ContactRecord
    after: ContactRecord
    start: float
    end: float


@dataclass(frozen=True)
class DetectorDiff:
    """One detector in two runs.

    ``same`` counts contacts that begin and end at the same time in both, ``shifted`` are those that moved, ``gained``
    and ``lost`` contacts that only the second, or only the first, run has. Ratios are seconds of the second
    over those of the first, ``None`` where one was not measured. ``same_verdicts``: whether the digests are equal,
    ``None`` where one has none. ``missed`` are contacts never found in the first and in the second, ``late`` those
    found late or cut short, the smallest and the largest count over the sampling offsets; ``false_contact`` the parts
    of the time reported that are false, means over these offsets; ``loss`` what ``replay.auditing.loss`` makes of them:
    all as the ranking of each run says them, ``None`` where the detector was not audited. ``labels`` are those in the
    first and in the second run, ``mean_seconds`` those a frame.
    """

    labels: Labels
    same: int
    gained: tuple[ContactRecord, ...]
    lost: tuple[ContactRecord, ...]
    shifted: tuple[Shift, ...]
    time_ratio: float | None
    p99_ratio: float | None
    same_verdicts: bool | None
    missed: CountBoundsPair
    late: CountBoundsPair
    false_contact: Fractions
    loss: Fractions
    mean_seconds: tuple[float, float]

    @property
    def changed(self) -> bool:
        """Whether any contact was gained, lost or shifted."""
        return bool(self.gained or self.lost or self.shifted)


@dataclass(frozen=True)
class RunDiff:
    """Two runs beside each other: label -> comparison of a detector of each, and the labels of the others.

    ``settings`` is name -> (first, second) of everything set differently. ``answer`` says whether the second run is
    better.
    """

    detectors: Mapping[str, DetectorDiff]
    only_a: tuple[str, ...]
    only_b: tuple[str, ...]
    settings: Mapping[str, tuple[Any, Any]]
    answer: str

    @property
    def changed(self) -> bool:
        """Whether any contact was gained, lost or shifted."""
        return any(detector.changed for detector in self.detectors.values())


def diff_runs(
    a: str | Path, b: str | Path, *, different_sessions: bool = False, compared_labels: Sequence[Labels] = ()
) -> RunDiff:
    """Compare two run folders; ``compared_labels`` are labels of the first and the second that are to be compared.

    Raises ``RunFolderError``: a folder that is none, or of another version; two recordings, unless they are meant to be
    ``different_sessions``; no detector of such a label.
    """
    runs = [read_run_folder(run) for run in (a, b)]
    for run in runs:
        if run.has_picture:
            _ = run.picture  # refused where it is not the one that the run wrote
    sessions = [run.document.session for run in runs]
    if len({session.digest for session in sessions} - {None}) > 1 and not different_sessions:
        session_ids = " and ".join(session.id for session in sessions)
        raise RunFolderError(
            f"{a} and {b} replay different recordings, {session_ids}: their contacts do not compare; "
            "if that is meant, add --different-sessions"
        )
    first_run, second_run = (run.document for run in runs)
    labels = matching_labels(first_run, second_run, compared_labels)
    detectors = {name_of(pair): _detector_diff(pair, runs) for pair in labels}
    settings = dict(_setting_differences(first_run, second_run, labels))
    return RunDiff(
        detectors=detectors,
        only_a=tuple(label for label in first_run.detectors if label not in {before for before, _ in labels}),
        only_b=tuple(label for label in second_run.detectors if label not in {after for _, after in labels}),
        settings=settings,
        answer=answer_of(first_run, second_run, detectors, settings),
    )


def name_of(labels: Labels) -> str:
    """``hull50``, or ``hull50 -> shipped50`` where the labels differ."""
    label_before, label_after = labels
    return label_before if label_before == label_after else f"{label_before} -> {label_after}"


def _detector_diff(labels: Labels, runs: Sequence[RunFolder]) -> DetectorDiff:
    """One detector of each run."""
    detectors = [run.document.detectors[label] for run, label in zip(runs, labels, strict=True)]
    contacts_before, contacts_after = (run.contacts[label] for run, label in zip(runs, labels, strict=True))
    number_of_pair = {name: k for k, name in enumerate(dict.fromkeys(map(_pair, (*contacts_before, *contacts_after))))}
    matched_pairs = matching_numbers(
        *(
            [_episode(number_of_pair[_pair(contact)], contact) for contact in contacts]
            for contacts in (contacts_before, contacts_after)
        )
    )
    common_contacts = [(contacts_before[i - 1], contacts_after[j - 1]) for i, j in matched_pairs]
    shifts = [
        Shift(
            first_contact,
            second_contact,
            second_contact.start - first_contact.start,
            second_contact.end - first_contact.end,
        )
        for first_contact, second_contact in common_contacts
    ]
    moved_shifts = tuple(
        shift for shift in shifts if round(shift.start * TICKS_PER_SECOND) or round(shift.end * TICKS_PER_SECOND)
    )
    kept_numbers, new_numbers = {i for i, _ in matched_pairs}, {j for _, j in matched_pairs}
    seconds, digests = [detector.seconds for detector in detectors], [detector.digest for detector in detectors]
    audits_of_runs = [run.document.audit.get(label) for run, label in zip(runs, labels, strict=True)]
    counts_over_offsets = [None if audit is None else audit.counts_over_offsets for audit in audits_of_runs]
    ranks = [_audited_rank(run, label) for run, label in zip(runs, labels, strict=True)]
    return DetectorDiff(
        labels=labels,
        same=len(shifts) - len(moved_shifts),
        gained=tuple(contact for k, contact in enumerate(contacts_after, 1) if k not in new_numbers),
        lost=tuple(contact for k, contact in enumerate(contacts_before, 1) if k not in kept_numbers),
        shifted=moved_shifts,
        time_ratio=_ratio(*(times.detect for times in seconds)),
        p99_ratio=_ratio(*(times.p99 for times in seconds)),
        same_verdicts=None if None in digests else digests[0] == digests[1],
        missed=tuple(
            None if counts_of_run is None else count_range(counts_of_run.contacts_missed)
            for counts_of_run in counts_over_offsets
        ),
        late=tuple(
            None if counts_of_run is None else count_range(counts_of_run.late_or_cut_short)
            for counts_of_run in counts_over_offsets
        ),
        false_contact=tuple(None if audit is None else audit.false_contact_mean.value for audit in audits_of_runs),
        loss=tuple(None if rank is None else rank.loss for rank in ranks),
        mean_seconds=(seconds[0].per_frame_mean, seconds[1].per_frame_mean),
    )


def _audited_rank(run: RunFolder, label: str) -> Rank | None:
    """The row of the ranking of an audited detector; ``None``: it was not audited."""
    return next((rank for rank in run.ranking if rank.label == label and label in run.document.audit), None)


def _episode(pair: int, contact: ContactRecord) -> Episode:
    start, end = contact.start, contact.end
    # A contact is over at its end: one that begins there does not overlap it.
    first_tick = round(start * TICKS_PER_SECOND)
    return Episode(pair, first_tick, max(first_tick, round(end * TICKS_PER_SECOND) - 1), start, end)


def _pair(contact: ContactRecord) -> tuple[str, str]:
    a, b = sorted(contact.bodies)
    return a, b


def _ratio(value_before: float | None, value_after: float | None) -> float | None:
    return value_after / value_before if value_before and value_after is not None else None


def _setting_differences(
    first_run: RunDocument, second_run: RunDocument, labels: Sequence[Labels]
) -> Iterator[tuple[str, tuple[Any, Any]]]:
    a, b = plain_of(first_run), plain_of(second_run)
    for name in SETTING_KEYS:
        yield from _unequal_leaves(name, a[name], b[name])
    # what was said of a pair's containment is an answer, not a setting
    yield from _unequal_leaves(
        "pairs", *([(pair.name, pair.grasp) for pair in run.pairs] for run in (first_run, second_run))
    )
    yield from _unequal_leaves("session.file", *(_recording_content(run) for run in (first_run, second_run)))
    for name in ("frames", "bodies"):
        yield from _unequal_leaves(f"session.{name}", a["session"][name], b["session"][name])
    for before, after in labels:
        for key in ("name", "settings"):
            name = f"{name_of((before, after))}.{key}"
            yield from _unequal_leaves(name, a["detectors"][before][key], b["detectors"][after][key])


def _recording_content(run: RunDocument) -> str:
    """The recording by its content: files with the same poses may hold other colliders, meshes or scenes."""
    recording_mark = run.session.recording
    return "in memory" if recording_mark is None else f"SHA-256 {recording_mark.sha256[:12]}"


def _unequal_leaves(name: str, a: Any, b: Any) -> Iterator[tuple[str, tuple[Any, Any]]]:
    """Leaves that differ, with their path."""
    if isinstance(a, Mapping) and isinstance(b, Mapping):
        for key in dict.fromkeys([*a, *b]):
            yield from _unequal_leaves(f"{name}.{key}", a.get(key), b.get(key))
    elif a != b:
        yield name, (a, b)
