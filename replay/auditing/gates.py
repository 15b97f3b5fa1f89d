"""Limits that a build server holds a detector to; a limit that was not measured counts as broken."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from sys import float_info
from typing import Any, Final

from replay import words
from replay.auditing.look_phases import PHASES
from replay.base.wilson import share
from replay.errors import AuditError


@dataclass(frozen=True)
class Gates:
    """What is not to be exceeded; ``None``: not asked for.

    Parameters
    ----------
    max_missed : share of the oracle's contacts never found, and of its pair-frames in contact not reported; of a
        detector of a step rate in the mean over its sampling offsets.
    max_p99_ms : milliseconds within which 99 of 100 samples are decided, of detectors that decide frame by frame: a
        sample is a frame on which the detector runs.
    max_invented : share of the pair-frames that a detector reports as contact which are none.

    Raises ``AuditError``: a share beyond 0 to 1, or a limit that is no number.
    """

    max_missed: float | None = None
    max_p99_ms: float | None = None
    max_invented: float | None = None

    def __post_init__(self) -> None:
        for name, most in (("max_missed", 1.0), ("max_p99_ms", float_info.max), ("max_invented", 1.0)):
            limit = getattr(self, name)
            if limit is not None and not (isinstance(limit, (int, float)) and 0.0 <= limit <= most):
                what = "milliseconds" if name == "max_p99_ms" else "a share from 0 to 1"
                raise AuditError(f"{name} is {limit}; give {what}")

    def broken(self, audit: Mapping[str, Any], summaries: Sequence[Mapping[str, Any]]) -> list[str]:
        """A sentence for each limit that was exceeded or could not be checked.

        ``audit`` has the figures over all sessions by label; ``summaries`` of the runs hold the times.
        """
        rows = (("--max-missed", self.max_missed, _missed), ("--max-invented", self.max_invented, _invented))
        found = []
        for name, most, check in rows:
            if most is not None:
                found += [] if audit else [f"{name} cannot be checked: nothing was audited"]
                found += [words for label, figures in audit.items() for words in check(name, label, figures, most)]
        return found + ([] if self.max_p99_ms is None else _late(audit, summaries, self.max_p99_ms))


def _missed(name: str, label: str, figures: Mapping[str, Any], most: float) -> Iterator[str]:
    firm = figures | figures.get("holds", {})
    contacts, undecided = firm["contacts"], figures["contact_frames_undecided"]
    if undecided:
        whole = f"{figures['contacts_undecided']} of {contacts} contacts"
        yield f"{name} cannot be checked: {label} left {undecided} pair-frames in contact undecided, {whole} whole"
    elif not contacts:
        what = "contact that holds in spite of the noise" if "holds" in figures else "contact"
        yield f"{name} cannot be checked: there is no {what} for {label} to miss"
    yield from _undecided_oracle(name, figures)
    for missed, part in _missed_shares(firm):
        if part["of"] and part["share"] > most:
            worse = f"{percent(part)}), more than {name} {most:g}{_apart(figures)}"
            worse += "; counted is what holds in spite of the noise" * ("holds" in figures)
            yield f"{label} missed {missed} ({worse}"


def _missed_shares(figures: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Contacts and pair-frames missed, in words and as a share: of a step rate the mean over its sampling offsets.

    Where sampling starts is chance; this run's offset alone would let a detector pass that fails at most others.
    """
    over, contacts = figures.get("phases"), figures["contacts"]
    if over is None:
        part, frames = share(figures["contacts_missed"], contacts), figures["missed"]
        yield f"{part['count']} of {contacts} contacts", part
        yield f"{frames['count']} of {frames['of']} pair-frames in contact", frames
        return
    where, counts = f"over {PHASES} sampling offsets", over_offsets(figures["offsets"]["contacts_missed"], contacts)
    yield f"contacts: {counts} {where}", over["contacts_missed"]
    yield f"pair-frames in contact, mean {where}", over["missed"]


def over_offsets(counts: Mapping[str, float], of: int) -> str:
    """``0.50 of 18, 0-1``: mean, and smallest to largest over the sampling offsets; one number where all are equal."""
    smallest, largest = round(counts["smallest"]), round(counts["largest"])
    if smallest == largest:
        return f"{smallest} of {of}"
    return f"{counts['mean']:.2f} of {of}, {smallest}-{largest}"


def _invented(name: str, label: str, figures: Mapping[str, Any], most: float) -> Iterator[str]:
    frames, over = figures["pair_frames"], figures.get("phases")
    if sum(frames.values()) == frames["LEFT_OUT"]:
        yield f"{name} cannot be checked: {label} was compared in no pair-frame"
    yield from _undecided_oracle(name, figures)
    part = (over or figures)["invented"]
    if part["of"] and part["share"] > most:
        count = f"{part['count']} of the {part['of']} pair-frames in contact that it reports"
        what = f"pair-frames in contact, mean over {PHASES} sampling offsets" if over else count
        yield f"{label} invented {what} ({percent(part)}), more than {name} {most:g}{_apart(figures)}"


def _apart(figures: Mapping[str, Any]) -> str:
    """What is not in the figures of a gate."""
    return "; what a hand holds is not counted" if any(figures.get("held", {}).values()) else ""


def _undecided_oracle(name: str, figures: Mapping[str, Any]) -> Iterator[str]:
    # What nobody can decide, whether a body is inside a mesh with holes, is counted for no detector and against none.
    undecided = figures["oracle_undecided"] - figures.get("oracle_inside_undecided", 0)
    if undecided:
        yield f"{name} cannot be checked: the reference left {undecided} pair-frames undecided"


def _late(audit: Mapping[str, Any], summaries: Sequence[Mapping[str, Any]], most: float) -> list[str]:
    found = [] if audit else ["--max-p99-ms cannot be checked: nothing was audited"]
    for summary in summaries:
        where = summary["session"].get("name") or f"session {summary['session']['id']}"
        for label in audit:
            if label not in summary["detectors"]:
                continue
            seconds = summary["detectors"][label]["seconds"]
            per_frame = seconds.get("per_frame")
            if per_frame is None:
                found.append(f"--max-p99-ms cannot be checked: {label} was not timed frame by frame in {where}")
            elif per_frame["p99"] * 1e3 > most:
                p99 = words.number_above(1e3 * per_frame["p99"], most)
                mean = words.frame_time(seconds["per_frame_mean"])
                found.append(
                    f"{label} takes {p99} ms at the 99th percentile of its samples in {where}, {mean} a frame in the "
                    f"mean, more than --max-p99-ms {most:g}"
                )
    return found


def percent(part: Mapping[str, Any], word: str = "") -> str:
    """``0.3 % [0.1, 0.6]``: a share and its interval for people; ``word``: of what, before the interval."""
    if part["share"] is None:
        return "none"
    share, low, high = (words.percentage(100 * part[name]) for name in ("share", "low", "high"))
    sure = f"[{low}, {high}]" if part["high"] - part["low"] <= WIDEST else TOO_FEW
    return f"{share} %{' ' if word else ''}{word} {sure}"


WIDEST: Final = 0.6
"""An interval wider than this spans most of 0 to 100 %."""

TOO_FEW: Final = "(too few contacts to say)"
