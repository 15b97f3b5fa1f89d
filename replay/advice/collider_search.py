"""The fewest convex pieces a body that keep false and missed contact below limits, and the front of what was tried.

Numbers of pieces are searched with the quickest way of cutting a body. Then finest pieces are tried that are joined
where the motion does not notice (``replay.advice.motion_joins``), and other ways of cutting.

Choices are weighed by the loss of ``replay.auditing.loss``: pieces of which a body misses more than they save are not
taken, whatever they do to false contact alone.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from time import monotonic
from typing import Any, Final

import numpy as np

from cdcore import Detection
from cdcore.bounding.hull import hull_collider
from cdcore.mesh import TriangleMesh
from cdcore.numerics import IntArray
from cdcore.protocol import Solids
from replay.advice.collider_verdicts import ColliderVerdicts, sampled_at_rate
from replay.advice.motion_joins import FalseContacts, joined_by_motion, refined_by_motion
from replay.advice.scoring import Scoring
from replay.auditing.outcome import Outcome
from replay.cutting.convex_solids import solids_of, volume_of, within_triangles
from replay.cutting.methods import METHODS, method_of
from replay.cutting.piece_store import Cut, NotCut, convex_pieces, cut_ahead, why_not_cut
from replay.detection.progress import Advance
from replay.errors import TradeoffError
from replay.prepare.assembly import Assembly

HULL_METHOD: Final = "hull"

PIECE_COUNTS: Final = (4, 8, 16, 32)
"""Pieces that are asked for, of a body that is not round."""

SECTOR_COUNTS: Final = (2, 3, 4, 6, 8, 10, 12, 14, 16, 18, 20, 24, 28, 32, 40, 48, 64, 96)
"""Pieces that are asked for, of a body that is round about an axis."""

SOLID_HULL_FRACTION: Final = 0.97
"""A body that fills this fraction of its hull is not cut."""

CONVEX_REASON: Final = "it is convex"
"""Why a body keeps its hull that has no reason to be cut."""

WORTHWHILE_VOLUME_RATIO: Final = 0.8
"""The next step of a body fills at most this fraction of the volume that its pieces filled before."""

LOSS_SLACK: Final = 0.02
"""So much more is no reason to keep pieces: of the loss, and of its missed part where the limits are reached."""

OTHER_METHODS: Final = ("vhacd", "coacd")
"""Methods that are tried in place of the quickest one, once the search has its numbers of pieces."""

COUNTS_PER_METHOD: Final = 2
"""Numbers of pieces that each of them is tried with."""

SIMILAR_LOSS: Final = 0.001
"""Losses that differ by no more are alike: fewer pieces are taken then, and of as many those of less volume."""

CUTTING_TIME_FRACTION: Final = 0.5
"""Fraction of the time that bodies may be cut ahead of the search."""

TRIAL_TIME_FRACTION: Final = 0.9
"""Fraction of the time after which no other method is cut."""

FINEST_PIECE_COUNT: Final = 200
"""Pieces that a body is cut into before they are joined by its motion, at most."""

JOINED_LABEL: Final = "joined by motion"
"""How pieces are made that are joined by motion, after the words of the method that cut them."""


class TimeUpError(Exception):
    """The time for the search is used up; what was found until then is written."""


class Deadline:
    """Tells how much of the time for a search is used up, as percents of progress; ``None``: there is no limit."""

    def __init__(self, seconds: float | None, advance: Advance) -> None:
        self._seconds, self._advance, self._began, self._percent = seconds, advance, monotonic(), 0

    def begin(self) -> None:
        """Count the time from now on."""
        self._began = monotonic()

    def left(self, fraction: float = 1.0) -> float:
        """Seconds until this fraction of the time is used up."""
        return float("inf") if self._seconds is None else self._began + fraction * self._seconds - monotonic()

    def report(self) -> None:
        """Report progress."""
        if self._seconds is not None:
            used_fraction = 1.0 - self.left() / max(self._seconds, 1e-9)
            percent = max(self._percent, min(99, int(100 * used_fraction)))
            self._advance(percent - self._percent)
            self._percent = percent

    def check(self) -> None:
        """Report progress. Raises ``TimeUpError``."""
        self.report()
        if self.left() <= 0.0:
            raise TimeUpError


def cut_in_time(cuts: Sequence[Cut], deadline: Deadline, fraction: float = 1.0) -> dict[str, NotCut]:
    """Cut what there is time for until this fraction of it is used up; key of a cut -> why it is not ready.

    A cut that takes longer than the time left is not begun.
    """
    # Pieces that are kept take no time, and are there when it is used up.
    remaining_seconds = max(0.0, deadline.left(fraction))
    not_cut_by_key = {cut.key: NotCut("", late=True) for cut in cuts if cut.seconds > remaining_seconds}
    cuts_in_time = [cut for cut in cuts if cut.key not in not_cut_by_key]
    return not_cut_by_key | cut_ahead(cuts_in_time, deadline.report, remaining_seconds)


@dataclass(frozen=True)
class Limits:
    """Fractions of wrong contact time that are still good enough, and the most pieces a body; ``None``: no limit."""

    false: float
    missed: float | None = None
    pieces: int | None = None

    def hold(self, false_fraction: float, missed_fraction: float) -> bool:
        """Whether both fractions are at most what was asked for."""
        return false_fraction <= self.false and (self.missed is None or missed_fraction <= self.missed)


@dataclass(frozen=True, eq=False)
class Tried:
    """One choice of pieces for all bodies, and what it makes of the session."""

    steps: tuple[int, ...]
    pieces: int
    false: float
    missed: float
    loss: float
    false_frames: IntArray

    @property
    def contact_loss(self) -> float:
        """The part of the loss that is contact missed or not reported."""
        return self.loss - self.false


class Ladder:
    """Pieces of one mesh, from its hull to at most so many; ``reason`` is why it is not cut, ``""`` where it is."""

    def __init__(self, mesh: TriangleMesh, deadline: Deadline, most_pieces: int | None = None) -> None:
        self.mesh, self.deadline = mesh, deadline
        self.reason = why_not_cut(mesh)
        hull = hull_collider(mesh)
        is_convex = not self.reason and abs(volume_of(mesh)) >= SOLID_HULL_FRACTION * volume_of(hull)
        self.reason = CONVEX_REASON if is_convex else self.reason
        self.method = HULL_METHOD if self.reason else method_of("auto", mesh)
        counts = {"sectors": SECTOR_COUNTS, HULL_METHOD: ()}.get(self.method, PIECE_COUNTS)
        if most_pieces is not None and counts:
            counts = (*(count for count in counts if count < most_pieces), *([most_pieces] if most_pieces > 1 else []))
        self.counts = (1, *counts)
        self._alternatives: list[Cut | str] = []
        self._made: dict[int, Sequence[TriangleMesh]] = {}
        self._unlimited: dict[int, Sequence[TriangleMesh]] = {}
        self._solids: dict[int, Solids] = {}

    def cut(self, step: int) -> Cut | str:
        """Cut that gives the pieces of a step, or how they were made otherwise."""
        if step < len(self.counts):
            return Cut(self.mesh, self.method, self.counts[step])
        return self._alternatives[step - len(self.counts)]

    def how(self, step: int) -> str:
        """How the pieces of a step are cut, in words."""
        cut = self.cut(step)
        return cut if isinstance(cut, str) else METHODS[cut.name if step else HULL_METHOD].words

    def finest_cut(self) -> Cut:
        """The cut into pieces that cover the whole body and are fine enough to be joined."""
        return Cut(self.mesh, "sectors" if self.method == "sectors" else "planes", FINEST_PIECE_COUNT)

    def other_cuts(self, step: int) -> list[Cut]:
        """Cuts by other methods with at most as many pieces as a step has, those that take least time first."""
        piece_count_of_step = len(self.pieces(step))
        piece_counts = [piece_count for piece_count in PIECE_COUNTS if piece_count <= piece_count_of_step][
            -COUNTS_PER_METHOD:
        ]
        cuts = [
            Cut(self.mesh, name, piece_count)
            for name in OTHER_METHODS
            if name != self.method
            for piece_count in piece_counts[::-1]
        ]
        return sorted(cuts, key=lambda cut: cut.seconds)

    def add_step(self, cut: Cut) -> int:
        """The step of a cut by another method, which ``above`` never leads to."""
        self._alternatives.append(cut)
        return len(self.counts) + len(self._alternatives) - 1

    def add_pieces(self, pieces: Sequence[TriangleMesh], how: str) -> int:
        """The step of pieces that were made otherwise, in words, which ``above`` never leads to.

        They get few enough triangles for engines when they are asked for: most steps never are.
        """
        self._alternatives.append(how)
        step = len(self.counts) + len(self._alternatives) - 1
        self._unlimited[step] = pieces
        return step

    def keep_cut_steps(self, not_cut_by_key: Mapping[str, NotCut]) -> None:
        """Leave out the steps that were not cut in time; where none was, say why."""
        cuts = [Cut(self.mesh, self.method, piece_count) for piece_count in self.counts[1:]]
        cut_counts = [cut.most for cut in cuts if cut.key not in not_cut_by_key]
        if cuts and not cut_counts:
            self.reason = not_cut_by_key[cuts[0].key].reason
        self.counts = (1, *cut_counts)

    def above(self, step: int) -> list[int]:
        """Steps to try next: the first one that is worth it, and the last."""
        finer_steps = range(step + 1, len(self.counts))
        filled_volume = _total_volume(self.pieces(step))
        worthwhile_steps = [
            finer_step
            for finer_step in finer_steps
            if _total_volume(self.pieces(finer_step)) <= WORTHWHILE_VOLUME_RATIO * filled_volume
        ]
        return sorted({*worthwhile_steps[:1], *finer_steps[-1:]})

    def pieces(self, step: int) -> Sequence[TriangleMesh]:
        """The pieces of a step. Raises ``TimeUpError`` where the time is up before they are cut."""
        if step in self._unlimited:
            self._made[step] = [within_triangles(piece) for piece in self._unlimited.pop(step)]
        elif step not in self._made:
            watch, cut = self.deadline.check if step else None, self.cut(step)
            assert isinstance(cut, Cut)  # pieces that no cut gives are kept
            self._made[step] = convex_pieces(cut, watch)
        return self._made[step]

    def solids(self, step: int) -> Solids:
        """The same with the surface around them, made once: to join 32 pieces takes 20 ms."""
        if step not in self._solids:
            self._solids[step] = solids_of(self.pieces(step))
        return self._solids[step]


def _total_volume(pieces: Sequence[TriangleMesh]) -> float:
    """The sum of the volumes of closed pieces."""
    return sum(abs(volume_of(piece)) for piece in pieces)


class ColliderSearch:
    """Takes more pieces of the bodies of the pair with most false contact, then fewer where that is free.

    Then pieces that are joined by motion and other methods are tried, with as many pieces or fewer.
    ``rate_setting``: settings of the engine's step.
    ``time_up``: whether the time ended the search; ``not_tried``: cuts that it left no time for, a body's name each.
    """

    def __init__(
        self,
        assembly: Assembly,
        scoring: Scoring,
        rate_setting: Mapping[str, float],
        limits: Limits,
        deadline: Deadline,
    ) -> None:
        self.time_up, self.deadline, self._limits = False, deadline, limits
        self._assembly, self._scoring, self._rate = assembly, scoring, dict(rate_setting)
        by_mesh = {body.mesh.content_hash: body.mesh for body in assembly.bodies}
        ladders = {content_hash: Ladder(mesh, deadline, limits.pieces) for content_hash, mesh in by_mesh.items()}
        self.ladders = {body.name: ladders[body.mesh.content_hash] for body in assembly.bodies}
        self._tried: dict[tuple[int, ...], Tried] = {}
        self._verdicts = ColliderVerdicts(assembly)
        self.steps = dict.fromkeys(self.ladders, 0)
        self.not_tried: list[tuple[str, Cut]] = []

    def _cut_ahead(self, false_frames: IntArray) -> None:
        """Cut every step of the bodies with false contact, as many as can be cut in half of the time."""
        columns = np.flatnonzero(false_frames).tolist()
        names = {name for column in columns for name in self._assembly.bodies_of(column)}
        ladders = {id(self.ladders[name]): self.ladders[name] for name in names}.values()
        cuts = [Cut(ladder.mesh, ladder.method, count) for ladder in ladders for count in ladder.counts[1:]]
        # The middle numbers of pieces first: they are the ones that are shipped most often.
        cuts.sort(key=lambda cut: abs(cut.most - 12))
        time_limit = max(0.0, self.deadline.left(CUTTING_TIME_FRACTION))
        not_cut_by_key = cut_ahead(cuts, self.deadline.report, time_limit)
        for ladder in ladders:
            ladder.keep_cut_steps(not_cut_by_key)
        self.time_up = any(not_cut.late for not_cut in not_cut_by_key.values())

    def run(self) -> None:
        """Search until the limits hold, nothing helps, or the time is up; ``steps`` are the best until then.

        Raises ``TradeoffError``: nothing touches, neither the meshes nor their hulls.
        """
        hulls = self._measure(self.steps)
        if not self._scoring.contacts and not hulls.false_frames.any():
            raise TradeoffError(
                "nothing touches in this session, not even the hulls: no collider does better; "
                "take a session in which bodies touch or are put into each other"
            )
        # The first detection of a machine compiles for seconds to minutes: a search would find nothing in what is left.
        self.deadline.begin()
        try:
            if not self._is_enough(hulls):
                self._cut_ahead(hulls.false_frames)
                self._add_pieces()
                self.descend()
                self.join_by_motion(hulls)
                self._try_other_methods()
        except TimeUpError:
            self.time_up = True
            self._take_best_tried()

    def _take_best_tried(self) -> None:
        """Take the choice with the smallest loss of all that were tried, of equals that with fewest pieces."""
        best_tried = min(
            self._tried.values(),
            key=lambda tried: (not self._is_enough(tried), round(tried.loss / SIMILAR_LOSS), tried.pieces),
        )
        self.steps = dict(zip(self.steps, best_tried.steps, strict=True))

    def pieces(self, steps: Mapping[str, int] | None = None) -> dict[str, Sequence[TriangleMesh]]:
        """Pieces of each body, of the best choice or of another one."""
        return {name: self.ladders[name].pieces(step) for name, step in (steps or self.steps).items()}

    def front(self) -> list[Tried]:
        """Pareto front of the tried choices: excess against pieces, fewest pieces first."""
        pareto_front: list[Tried] = []
        for tried in sorted(self._tried.values(), key=lambda tried: (tried.pieces, tried.loss)):
            if not pareto_front or tried.loss < pareto_front[-1].loss:
                pareto_front.append(tried)
        return pareto_front

    def cut_in_time(self, cuts: Sequence[Cut]) -> dict[str, NotCut]:
        """Cut what there is time for before the fraction of it in which other methods are tried is used up."""
        return cut_in_time(cuts, self.deadline, TRIAL_TIME_FRACTION)

    def _is_enough(self, tried: Tried) -> bool:
        """Whether a choice keeps to the limits."""
        return self._limits.hold(tried.false, tried.missed)

    def _add_pieces(self) -> None:
        """Take more pieces as long as the loss falls and the limits are not reached."""
        tried = self._measure(self.steps)
        exhausted_pairs: set[int] = set()
        while not self._is_enough(tried):
            false_frames = tried.false_frames
            worst_pairs_first = np.argsort(-false_frames, kind="stable").tolist()
            worst = next(
                (column for column in worst_pairs_first if column not in exhausted_pairs and false_frames[column]), None
            )
            if worst is None:
                break
            choices = [(self._measure(steps), steps) for steps in self._finer_choices(self.steps, worst)]
            best_choice = min(choices, key=lambda choice: (choice[0].loss, choice[0].pieces), default=None)
            if best_choice is None or best_choice[0].loss >= tried.loss:
                exhausted_pairs.add(worst)
                continue
            tried, self.steps = best_choice

    def descend(self) -> None:
        """Take fewer pieces of each body where that costs nothing, the body of most pieces first."""
        current_choice = self._measure(self.steps)
        for name in sorted(self.steps, key=lambda body: -len(self.ladders[body].pieces(self.steps[body]))):
            self.steps = {**self.steps, name: self._least(self.steps, name, current_choice)}
        self._drop_losers()

    def _least(self, steps: Mapping[str, int], name: str, current_choice: Tried) -> int:
        """The first step of a body with which little enough is wrong: the hull, or the first that is good enough."""
        within_limits = self._is_enough(current_choice)

        def enough(step: int) -> bool:
            tried = self._measure({**steps, name: step})
            if within_limits:
                return self._is_enough(tried) and tried.contact_loss <= current_choice.contact_loss + LOSS_SLACK
            return tried.loss <= current_choice.loss + LOSS_SLACK

        # A few pieces may be worse than the hull, so that it is tried by itself.
        return 0 if enough(0) else bisect_left(range(steps[name]), True, key=enough)

    def _try_other_methods(self) -> None:
        """Take pieces of another method where they lose less, or as little with fewer pieces or less volume."""
        by_ladder = {id(self.ladders[name]): (name, step) for name, step in self.steps.items() if step}
        cuts = {
            cut.key: (name, cut) for name, step in by_ladder.values() for cut in self.ladders[name].other_cuts(step)
        }
        not_cut_by_key = self.cut_in_time([cut for _, cut in cuts.values()])
        self.not_tried = [cuts[key] for key, not_cut in not_cut_by_key.items() if not_cut.late]
        for name in [name for name, step in self.steps.items() if step]:
            ladder = self.ladders[name]
            for cut in ladder.other_cuts(self.steps[name]):
                if cut.key not in not_cut_by_key:
                    steps = {**self.steps, name: ladder.add_step(cut)}
                    self.steps = min(self.steps, steps, key=self._merit)

    def join_by_motion(self, hulls: Tried) -> None:
        """Take finest pieces, joined where the motion does not notice, in place of those of a body that are worse.

        The bodies with most false contact come first: their pieces may leave others nothing to do.
        """
        pairs = self._assembly.pairs
        false_frames_of_body = {
            name: int(hulls.false_frames[(pairs == k).any(axis=1)].sum()) for k, name in enumerate(self.steps)
        }
        names = [name for name in self.steps if false_frames_of_body[name] and not self.ladders[name].reason]
        names.sort(key=lambda name: -false_frames_of_body[name])
        not_cut_by_key = self.cut_in_time([self.ladders[name].finest_cut() for name in names])
        for name in names:
            cut = self.ladders[name].finest_cut()
            # A body whose hull was taken back loses as much by pieces as it saves.
            if cut.key in not_cut_by_key or (not self.steps[name] and self._limits.pieces is None):
                continue
            for step in self._joined_steps(name, cut):
                self.steps = min(self.steps, {**self.steps, name: step}, key=self._merit)
        self.time_up = self.time_up or any(not_cut.late for not_cut in not_cut_by_key.values())

    def _joined_steps(self, name: str, cut: Cut) -> Iterator[int]:
        """Steps of a body with pieces joined by its motion: as many as it has now, or fewer where that is free."""
        ladder, check_time = self.ladders[name], self.deadline.check
        steps_with_hull = {**self.steps, name: 0}
        assembly, detection = self._with_pieces(steps_with_hull), self._at_every_frame(steps_with_hull)
        false_contact = self._scoring.reference.compare(detection).outcome == Outcome.FALSE_CONTACT
        false_contacts = FalseContacts(assembly, name, false_contact)
        most_pieces = self._limits.pieces or len(ladder.pieces(self.steps[name]))
        finest_pieces = convex_pieces(cut, check_time)
        for piece_set in (finest_pieces, refined_by_motion(finest_pieces, ladder.mesh, false_contacts, check_time)):
            levels = joined_by_motion(piece_set, false_contacts, check_time)
            piece_counts = sorted(count for count in levels if count <= most_pieces)
            if not piece_counts:
                continue
            steps = [ladder.add_pieces(levels[count], f"{cut.row.words}, {JOINED_LABEL}") for count in piece_counts]
            current_choice = self._measure({**self.steps, name: steps[-1]})

            def enough(step: int, reached: Tried = current_choice) -> bool:
                tried = self._measure({**self.steps, name: step})
                return tried.loss <= reached.loss + SIMILAR_LOSS and self._is_enough(tried) >= self._is_enough(reached)

            yield steps[bisect_left(steps[:-1], True, key=enough)]

    def _merit(self, steps: Mapping[str, int]) -> tuple[int, float, int, float]:
        """Order of choices that may replace each other: the limits, the loss, the pieces, the volume that they fill."""
        tried = self._measure(steps)
        filled_volume = sum(_total_volume(pieces) for pieces in self.pieces(steps).values())
        return not self._is_enough(tried), round(tried.loss / SIMILAR_LOSS), tried.pieces, filled_volume

    def _drop_losers(self) -> None:
        """Give bodies their hull back whose pieces lose as much as they save, the worst of them first."""
        while True:
            loss = self._measure(self.steps).loss
            with_hull = [{**self.steps, name: 0} for name, step in self.steps.items() if step]
            best_steps = min(with_hull, key=lambda steps: self._measure(steps).loss, default=None)
            if best_steps is None or self._measure(best_steps).loss > loss:
                return
            self.steps = best_steps

    def _finer_choices(self, steps: Mapping[str, int], column: int) -> list[dict[str, int]]:
        """More pieces of one body of a pair, or of both: one alone may change nothing."""
        finer_steps_of_body = {name: self.ladders[name].above(steps[name]) for name in self._assembly.bodies_of(column)}
        step_choices = [
            {**steps, name: step} for name, finer_steps in finer_steps_of_body.items() for step in finer_steps
        ]
        if all(finer_steps_of_body.values()):
            step_choices.append(
                {**steps, **{name: finer_steps[-1] for name, finer_steps in finer_steps_of_body.items()}}
            )
        return step_choices

    def _measure(self, steps: Mapping[str, int]) -> Tried:
        """Errors of a choice over the session; measured once."""
        step_key = tuple(steps.values())
        if step_key not in self._tried:
            # The hulls are counted whatever it takes: they are what is written where nothing else was tried in time.
            if self._tried:
                self.deadline.check()
            pieces, detection = self.pieces(steps), self._at_every_frame(steps)
            rate_hz = self._rate.get("rate_hz")
            comparison = self._scoring.reference.compare(sampled_at_rate(detection, rate_hz))
            figures = self._scoring.figures_of(comparison, detection, rate_hz)
            false_fraction, missed_fraction = figures["false"] or 0.0, figures["not_reported"] or 0.0
            self._tried[step_key] = Tried(
                steps=step_key,
                pieces=sum(map(len, pieces.values())),
                false=false_fraction,
                missed=missed_fraction,
                loss=figures["loss"],
                false_frames=comparison.by_pair[:, Outcome.FALSE_CONTACT],
            )
        return self._tried[step_key]

    def _with_pieces(self, steps: Mapping[str, int]) -> Assembly:
        """The bodies with the pieces of a choice as their colliders."""
        solids = self._solids(steps)
        bodies = tuple(replace(body, colliders=solids[body.name]) for body in self._assembly.bodies)
        return replace(self._assembly, bodies=bodies)

    def _at_every_frame(self, steps: Mapping[str, int]) -> Detection:
        """Return what the pieces of a choice report at every frame."""
        return self._verdicts.at_every_frame(self._solids(steps))

    def _solids(self, steps: Mapping[str, int]) -> dict[str, Solids]:
        """Solids of each body."""
        return {name: self.ladders[name].solids(step) for name, step in steps.items()}


def as_row(choice: Tried) -> dict[str, Any]:
    """One row of the front, as plain data."""
    return {"pieces": choice.pieces, "loss": choice.loss, "false": choice.false, "missed": choice.missed}
