"""Moments of a run in one list, of all its detectors: what each missed, what it invented, and one contact of each
other pair. The pair of a moment is the pair in focus."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Final

import numpy as np

from replay.comparison.false_contacts import FalseContact
from replay.comparison.misses import by_depth
from replay.comparison.outcome import Episode, Miss, Outcome
from replay.effects.output import Vector, vector_of
from replay.outputs.palette import FOUND, INVENTED, MISSED, Rgba
from replay.outputs.words import bound_words, counted, false_thing
from replay.pipeline.run_result import RunResult
from replay.pipeline.scores import LISTED

KINDS: Final = {Outcome.MISSED: "miss", Outcome.INVENTED: "false", Outcome.BOTH: "contact"}


@dataclass(frozen=True)
class FocusMoment:
    """Where the cursor meets a fault, or a contact."""

    frame: int  # no two moments have the same frame and the same nanoseconds ``later``
    later: int
    pair: int  # column of the pair in focus
    point: Vector  # where in the world
    label: str  # the detector; ``""`` where nobody is at fault
    number: int  # its number of the fault, or 0
    outcome: Outcome  # ``MISSED``, ``INVENTED`` or ``BOTH``
    first: int  # frames of the stretch
    last: int
    size: float  # metres of the longest cut, or of the gap between the meshes; nan: not measured
    kind: str  # of the miss or the false contact; ``""`` of a contact
    said: str  # Markdown about it
    of: Miss | FalseContact | None = field(default=None, compare=False)  # the fault itself; ``None`` of a contact

    @property
    def colour(self) -> Rgba:
        """Red is missed, yellow invented, blue found."""
        if self.outcome == Outcome.MISSED:
            return MISSED
        return INVENTED if self.outcome == Outcome.INVENTED else FOUND

    @property
    def words(self) -> str:
        """What it is: for a flag and a line."""
        return f"{KINDS[self.outcome]} {self.number or ''}".rstrip()


def key_moments(result: RunResult) -> list[FocusMoment]:
    """All moments, in order of time; of those in one frame the worst comes last, by a nanosecond."""
    found = [*_faults(result)]
    seen = {one.pair for one in found}
    found += [_contact(result, pair, one) for pair, one in _longest(result).items() if pair not in seen]
    found.sort(key=lambda one: (one.frame, one.later, one.outcome == Outcome.MISSED, one.size))
    made: list[FocusMoment] = []
    for one in found:
        before = made[-1] if made and made[-1].frame == one.frame else None
        made.append(replace(one, later=max(one.later, before.later + 1) if before else one.later))
    return made


def focus_rows(moments: Sequence[FocusMoment]) -> list[tuple[int, int, FocusMoment]]:
    """Frame, nanoseconds after it, and the moment in focus from there on: it changes half-way between moments."""
    rows = [(0, 0, moments[0])] if moments else []
    for before, one in pairwise(moments):
        same = before.frame == one.frame
        rows.append((one.frame, one.later, one) if same else ((before.frame + one.frame + 1) // 2, 0, one))
    return rows


def _faults(result: RunResult) -> Iterator[FocusMoment]:
    contacts = len(result.episodes[result.oracle])
    for label, misses in result.misses.items():
        for one in by_depth(misses):
            yield FocusMoment(
                *one.shown, one.pair, one.point, label, one.number, Outcome.MISSED, one.first, one.last, one.cut_length,
                one.kind, miss_note(one, len(misses), contacts, label, result.oracle), one,
            )  # fmt: skip
        for no in sorted(result.false.get(label, ()), key=lambda one: -one.frames)[:LISTED]:
            yield FocusMoment(
                no.widest, 0, no.pair, no.point, label, no.number, Outcome.INVENTED, no.first, no.last, no.gap, no.kind,
                false_note(no, len(result.false.get(label, ())), label, result.oracle), no,
            )  # fmt: skip


def _longest(result: RunResult) -> dict[int, Episode]:
    """Pair -> its longest contact, the oracle's before anybody else's."""
    found: dict[int, Episode] = {}
    for label in (result.oracle, *result.comparisons):
        own: dict[int, Episode] = {}
        for one in result.episodes[label]:
            if one.last - one.first >= (own[one.pair].last - own[one.pair].first if one.pair in own else 0):
                own[one.pair] = one
        found = own | found
    return found


def _contact(result: RunResult, pair: int, one: Episode) -> FocusMoment:
    frame, motion = (one.first + one.last) // 2, result.assembly.motion
    point = motion.translations[frame, result.assembly.pairs[pair]].mean(axis=0)
    counts = []
    for label, comparison in result.comparisons.items():
        kinds = (Outcome.MISSED, Outcome.INVENTED, Outcome.HELD)
        missed, invented, held = (int((comparison.outcome[:, pair] == one).sum()) for one in kinds)
        apart = f", {held:,} held, not counted" if held else ""
        counts.append(f"- {label}: {counted(missed, 'frame')} missed, {invented:,} false{apart}")
    lines = [f"#### {result.assembly.pair_name(pair)}, in the whole session", "", *counts]
    return FocusMoment(
        frame, 0, pair, vector_of(point), "", 0, Outcome.BOTH, one.first, one.last, 0.0, "", "\n".join(lines)
    )


def moment_line(moment: FocusMoment, name: str, widths: tuple[int, int]) -> str:
    """One line of the list; ``name``: of the pair; ``widths``: of label and name."""
    what = "curve" if moment.outcome == Outcome.MISSED else "apart"
    size = f"{moment.size * 1e3:.1f} mm {what}" if moment.label and moment.size > 0 else ""
    line = f"{moment.label:<{widths[0]}} {moment.words:<8}  {name:<{widths[1]}} {size:>14}"
    if moment.of is None:
        return f"{line}  {counted(moment.last - moment.first + 1, 'frame')}"
    # In a narrow view the end is cut: what tells moments apart comes first.
    late = f"{moment.kind}: " if moment.outcome == Outcome.MISSED else ""
    return f"{line}  {late}{moment.of.cause}"


def miss_note(miss: Miss, count: int, contacts: int, label: str, oracle: str) -> str:
    """What is to be said about a miss, of ``count`` by this detector and of so many ``contacts``; why comes first."""
    found = f"{oracle}: **CONTACT**, {miss.face_pairs} face pairs, cut {miss.cut_length * 1e3:.1f} mm"
    if miss.touch is not None:
        before, (a, b), bound = miss.touch.frame, miss.touch.faces, bound_words(miss)
        found = (
            f"{oracle}: **CONTACT** between frames {before} and {before + 1}, from {miss.touch.moment:.6f} s"
            f"{bound and f' ({bound})'}; no frame shows it\n"
            f"- first faces {a} of {miss.body_a} and {b} of {miss.body_b}, shown where they touch"
        )
    return (
        f"#### Miss {miss.number} of {count}: {miss.body_a}-{miss.body_b}\n\n"
        f"- {label}: **{miss.kind}** ({miss.cause})\n"
        f"- {found}\n\n"
        f"**{miss.seconds:.3f} s**, {counted(miss.frames, 'frame')} ({miss.first} to {miss.last}), "
        f"contact {miss.episode} of {contacts}\n\n"
        f"`replay view RUN --miss {miss.number} --by {label}`"
    )


def false_note(one: FalseContact, count: int, label: str, oracle: str) -> str:
    """What is to be said about a false contact, of ``count`` by this detector; why comes first."""
    gap = "" if np.isnan(one.gap) else f", the meshes are **{one.gap * 1e3:.1f} mm** apart"
    return (
        f"#### {false_thing([one]).capitalize()} {one.number} of {count}: {one.body_a}-{one.body_b}\n\n"
        f"- {label}: **{'CANDIDATE' if one.unconfirmed else 'CONTACT'}** ({one.cause})\n"
        f"- {oracle}: none{gap}\n\n"
        f"**{one.start:.3f} s**, {counted(one.frames, 'frame')} ({one.first} to {one.last}), {one.kind}\n\n"
        f"`replay view RUN --false {one.number} --by {label}`"
    )


def worst_first(result: RunResult) -> list[str]:
    """Audited detectors, the one with the largest fault first."""
    return [one.label for one in result.ranking[:-1]]


def leading(result: RunResult, moments: Sequence[FocusMoment]) -> int:
    """Which moment comes first: that of the answer; where nothing is wrong the longest contact."""
    key = result.answers[0].moment if result.answers else None
    if key is None:
        return max(range(len(moments)), key=lambda k: moments[k].last - moments[k].first)
    kind = Outcome.INVENTED if key.kind == "false" else Outcome.MISSED
    wanted = (result.answers[0].label, kind, key.number)
    found = (k for k, one in enumerate(moments) if (one.label, one.outcome, one.number) == wanted)
    return next(found, 0)
