"""Measures the Fix of a run's colliders: cuts the bodies of its worst pairs, replays them, and says what that gives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from time import monotonic
from typing import Any, Final

import numpy as np
from msgspec import structs

from cdcore import Detection
from cdcore.bounding.hull import hull_collider
from cdcore.detectors.detector_table import settings_of
from cdcore.mesh import TriangleMesh
from cdcore.numerics import FloatArray, IntArray
from replay.advice.collider_verdicts import ColliderVerdicts, sampled_at_rate
from replay.advice.scoring import wrong_counts
from replay.auditing.contact_counts import ContactCounts, count_contacts, count_reports
from replay.auditing.episodes import column_runs
from replay.auditing.outcome import Comparison, Episode, Outcome
from replay.auditing.sampling_offsets import (
    OFFSET_COUNT,
    OFFSET_SETTING,
    OffsetCounts,
    Proportions,
    has_offsets,
    offset_counts,
)
from replay.auditing.tolerance import Reference
from replay.auditing.wilson import Proportion, proportion
from replay.cutting.compound import names_as_setting, with_pieces
from replay.cutting.convex_solids import volume_of
from replay.cutting.piece_store import Cut, cut_ahead, why_not_cut
from replay.detection.detector_spec import DetectorSpec, parse_detector, spec_text
from replay.detection.progress import Advance, Progress
from replay.detection.run_detector import Run, run_detector
from replay.document.answer import Answer, Fix, FixFigures
from replay.document.before_after import Errors, change_text, errors_of_rank, errors_of_row, worse_text
from replay.document.cost import busy_sentence, busy_text
from replay.document.decision import SHIP_COMMAND
from replay.document.diagnosis import pieces_may_help
from replay.document.ranking import Rank
from replay.document.run_result import RunResult
from replay.document.summary import sample_times
from replay.words import duration, joined_names, plural, rate

FIX_SECONDS: Final = 20.0
"""Seconds that the command line gives a Fix when nothing is said."""

FIRST_PIECE_COUNT: Final = 16
"""The most pieces a body that are tried first; then half of them and twice as many."""

ACCEPTED_WRONG_FRACTION: Final = 0.05
"""Wrong pair-frames, as a fraction of the right ones, that may be left to pairs whose bodies are not cut."""

ACCEPTED_EXTRA_LOSS: Final = 0.02
"""More loss than the best number of pieces has that fewer pieces are worth."""

REPLAY_TIME_FRACTION: Final = 0.3
"""Fraction of the time that is kept for replaying what was cut."""

SOLID_HULL_FRACTION: Final = 0.97
"""A body that fills this fraction of its hull is its own piece."""

TIMED_FRAMES: Final = 1536
"""Frames in which pieces are timed, at most: their mean and 99th percentile are those of a longer motion."""

TIMED_SEGMENTS: Final = 16
"""Stretches of neighbouring frames that these frames are in."""

REPLACED_SETTINGS: Final = ("shape", "pieces", "method", "cut")
"""Settings of a collider that its pieces replace."""


def measured_fixes(result: RunResult, time_limit: float, progress: Progress) -> RunResult:
    """The run with a measured Fix for each detector whose colliders are what is wrong, within ``time_limit`` seconds.

    Without time, without an audit, or where pieces cannot help, the run is returned as it is.
    """
    ranks = {rank.label: rank for rank in result.ranking}
    # Those whose fix is not measured yet, and whose larger fault comes from the shape of their colliders.
    labels = [
        answer.label
        for answer in result.answers
        if not (answer.fix is None or answer.fix.measured) and pieces_may_help(result, ranks[answer.label])
    ]
    if time_limit <= 0.0 or not labels or result.reference is None:
        return result
    fix_of_label: dict[str, Fix] = {}
    start_time = monotonic()
    with progress.stage(f"Measuring a fix, {duration(time_limit)} at most", 100) as advance:
        clock = _Clock(start_time + time_limit, time_limit, advance)
        for label in labels:
            fix = _Measuring(result, result.reference, ranks[label], clock).fix()
            if fix is not None:
                fix_of_label[label] = fix
        clock.finish()
    answers = tuple(replace_fix(answer, fix_of_label.get(answer.label)) for answer in result.answers)
    return replace(result, answers=answers, document=structs.replace(result.document, answers=answers))


def replace_fix(answer: Answer, fix: Fix | None) -> Answer:
    """The answer with another Fix, or as it is."""
    return answer if fix is None else structs.replace(answer, fix=fix)


class _Clock:
    """Tells how much time is left, and reports it as percents of progress."""

    def __init__(self, end: float, limit: float, advance: Advance) -> None:
        self._end, self.limit, self._advance, self._percent = end, limit, advance, 0

    def left(self) -> float:
        """Seconds until the time is up."""
        return self._end - monotonic()

    def check(self) -> None:
        """Report progress."""
        percent = min(99, max(self._percent, int(100 * (1.0 - self.left() / self.limit))))
        self._advance(percent - self._percent)
        self._percent = percent

    def finish(self) -> None:
        """Report that all is done."""
        self._advance(100 - self._percent)
        self._percent = 100


@dataclass(frozen=True, eq=False)
class _Measured:
    """The figures of a detector with pieces, as ``run`` counts them, and its seconds a frame.

    ``busy``: that other programs had the processor meanwhile, as a sentence; ``pieces``: of each body that is cut.
    """

    spec: DetectorSpec
    counts: Mapping[str, Any]
    seconds: float
    busy: str
    pieces: Mapping[str, int]
    figures: FixFigures


class _Measuring:
    """Cuts and replays for one detector of a run."""

    def __init__(self, result: RunResult, reference: Reference, rank: Rank, clock: _Clock) -> None:
        self._result, self._reference, self._rank, self._clock = result, reference, rank, clock
        self._began = monotonic()
        spec = parse_detector(f"fix={rank.setting}")
        self._rest = {key: value for key, value in spec.settings.items() if key not in REPLACED_SETTINGS}
        self._seed = result.document.seed
        self._verdicts = ColliderVerdicts(result.assembly, self._rest.get("skin_m", 0.0))
        self._counted: dict[str, tuple[ContactCounts, None, Proportion]] = {}
        self._offsets: tuple[str, OffsetCounts] | None = None

    def fix(self) -> Fix | None:
        """The Fix that was measured; ``None``: no body of the worst pairs is worth cutting."""
        meshes = {body.name: body.mesh for body in self._result.assembly.bodies}
        worst_bodies = self._worst_bodies()
        reasons = {name: _why_not_cut(meshes[name]) for name in worst_bodies}
        bodies = [name for name in worst_bodies if not reasons[name] and not _is_convex(meshes[name])]
        uncut_sentences = [f"{name} keeps its hull: {why}." for name, why in reasons.items() if why]
        if not bodies:
            return None if not uncut_sentences else self._not_cut(uncut_sentences)
        ready_bodies, late_sentences = self._cut(
            [Cut(meshes[name], "auto", FIRST_PIECE_COUNT) for name in bodies], bodies
        )
        if not ready_bodies:
            return self._not_cut([*uncut_sentences, *late_sentences])
        cut_bodies = self._worth_cutting(ready_bodies, FIRST_PIECE_COUNT)
        most_pieces = self._fewest(cut_bodies, meshes)
        if most_pieces != FIRST_PIECE_COUNT:
            cut_bodies = self._worth_cutting(cut_bodies, most_pieces)
        spec_with_step = self._spec(cut_bodies, most_pieces)
        spec = self._without_new_misses(spec_with_step)
        best_measured = self._figures(spec, cut_bodies)
        uncut_bodies = [name for name in ready_bodies if name not in cut_bodies]
        stay_verb = "stays" if len(uncut_bodies) == 1 else "stay"
        loser_sentences = [f"{joined_names(uncut_bodies)} {stay_verb} whole: no better cut."] if uncut_bodies else []
        seconds = duration(round(monotonic() - self._began, 1))
        if best_measured.counts["loss"] >= self._rank.loss:
            remarks = "".join(f" {sentence}" for sentence in (*uncut_sentences, *late_sentences))
            return Fix(
                text=f"Convex pieces of {joined_names(cut_bodies)} make it no better.",
                measured=False,
                change=f"{self._change(best_measured)}.",
                notes=f"Measured here in {seconds}.{remarks} {self._result.oracle} tests every triangle.",
            )
        step, trade = "", []
        if spec is not spec_with_step:
            step = ", and test every frame"
            change_sentence = change_text(*self._errors_of(self._errors_at_step(spec_with_step)))
            trade = [f"At {rate(self._rest['rate_hz'])} instead: {change_sentence}."]
        busy_sentences = [best_measured.busy] if best_measured.busy and not busy_text(self._result.document) else []
        return Fix(
            text=f"Split {_pieces_text(best_measured.pieces)}{self._uncut_text(cut_bodies)}{step}.",
            measured=True,
            command=SHIP_COMMAND,
            setting=spec_text(best_measured.spec.name, best_measured.spec.settings),
            figures=best_measured.figures,
            change=f"{self._change(best_measured)}.",
            notes=" ".join(
                [
                    f"Measured here in {seconds}.",
                    *trade,
                    *busy_sentences,
                    *uncut_sentences,
                    *loser_sentences,
                    *late_sentences,
                ]
            ),
        )

    def _uncut_text(self, cut_bodies: Sequence[str]) -> str:
        """That every other body has one hull, as a clause; ``""``: there is no other body."""
        return ", with one hull for every other body" if len(self._result.assembly.bodies) > len(cut_bodies) else ""

    def _not_cut(self, sentences: Sequence[str]) -> Fix | None:
        """A Fix that says why nothing was measured, beside the one that the run has."""
        answer = next(answer for answer in self._result.answers if answer.label == self._rank.label)
        assert answer.fix is not None
        return structs.replace(answer.fix, text=f"{' '.join(sentences)} {answer.fix.text}")

    def _worst_bodies(self) -> list[str]:
        """Names of the bodies of the pairs that hold most of what is wrong, the worst first."""
        by_pair = self._result.comparisons[self._rank.label].by_pair
        wrong_frames = by_pair[:, [Outcome.MISSED, Outcome.FALSE_CONTACT]].sum(axis=1)
        right_frames, remaining_frames = int(by_pair[:, Outcome.BOTH].sum()), int(wrong_frames.sum())
        worst = []
        for pair in np.argsort(-wrong_frames, kind="stable").tolist():
            if remaining_frames <= ACCEPTED_WRONG_FRACTION * right_frames or not wrong_frames[pair]:
                break
            worst.append(pair)
            remaining_frames -= int(wrong_frames[pair])
        return list(dict.fromkeys(name for pair in worst for name in self._result.assembly.bodies_of(pair)))

    def _cut(self, cuts: Sequence[Cut], names: Sequence[str]) -> tuple[list[str], list[str]]:
        """Names of the bodies whose pieces are ready, and a sentence about each of the others."""
        time_limit = self._clock.left() - REPLAY_TIME_FRACTION * self._clock.limit
        seconds_of_cut = {cut.key: cut.seconds for cut in cuts}
        not_cut_by_key = cut_ahead(cuts, self._clock.check, max(0.0, time_limit))
        ready_names = [name for name, cut in zip(names, cuts, strict=True) if cut.key not in not_cut_by_key]
        late_sentences = []
        for name, cut in zip(names, cuts, strict=True):
            if cut.key not in not_cut_by_key:
                continue
            not_cut = not_cut_by_key[cut.key]
            if not_cut.late:
                more_time = duration(max(seconds_of_cut[cut.key], not_cut.spent))
                late_sentences.append(
                    f"Not reached within {duration(self._clock.limit)}: {name} (about {more_time} more)."
                )
            else:
                late_sentences.append(f"{name} is not cut: {not_cut.reason}.")
        return ready_names, late_sentences

    def _fewest(self, names: Sequence[str], meshes: Mapping[str, TriangleMesh]) -> int:
        """The fewest pieces a body with nearly the smallest loss at every frame, of those cut in time."""
        loss_of_count = {FIRST_PIECE_COUNT: self._loss_at_every_frame(self._spec(names, FIRST_PIECE_COUNT))}
        half_count, quarter_count, double_count = FIRST_PIECE_COUNT // 2, FIRST_PIECE_COUNT // 4, 2 * FIRST_PIECE_COUNT
        for most in (half_count, quarter_count, double_count):
            is_half_enough = _fewest_enough(loss_of_count) < FIRST_PIECE_COUNT
            # A quarter is tried where half of the pieces do as well, twice as many where they do not.
            if (most == quarter_count and not is_half_enough) or (most == double_count and is_half_enough):
                continue
            cuts = [Cut(meshes[name], "auto", most) for name in names]
            needed_seconds = sum({cut.key: cut.seconds for cut in cuts}.values())
            remaining_seconds = self._clock.left() - REPLAY_TIME_FRACTION * self._clock.limit
            if remaining_seconds > needed_seconds and not cut_ahead(cuts, self._clock.check, remaining_seconds):
                loss_of_count[most] = self._loss_at_every_frame(self._spec(names, most))
            self._clock.check()
        return _fewest_enough(loss_of_count)

    def _worth_cutting(self, names: Sequence[str], most_pieces: int) -> list[str]:
        """The bodies of which at most so many pieces save more than they miss, at least one."""
        cut_bodies, loss = list(names), self._loss_at_every_frame(self._spec(names, most_pieces))
        for name in names:
            other_bodies = [other for other in cut_bodies if other != name]
            if not other_bodies or self._clock.left() <= 0.0:
                break
            loss_without = self._loss_at_every_frame(self._spec(other_bodies, most_pieces))
            if loss_without <= loss:
                cut_bodies, loss = other_bodies, loss_without
            self._clock.check()
        return cut_bodies

    def _spec(self, names: Sequence[str], most_pieces: int) -> DetectorSpec:
        pieces = {"shape": "compound", "pieces": most_pieces, "method": "auto", "cut": names_as_setting(names)}
        return DetectorSpec("fix", "collider", {**pieces, **self._rest})

    def _loss_at_every_frame(self, spec: DetectorSpec) -> float:
        return float(wrong_counts(*self._counts_at_every_frame(spec), None)["loss"])

    def _counts_at_every_frame(self, spec: DetectorSpec) -> tuple[ContactCounts, None, Proportion]:
        """The input of ``wrong_counts`` for pieces that are tested in every frame; counted once."""
        frame_spec = _at_every_frame(spec)
        if frame_spec.text not in self._counted:
            comparison = self._reference.compare(self._at_every_frame(frame_spec))
            frame_counts = count_contacts(comparison, self._reference.contacts)
            self._counted[frame_spec.text] = (
                frame_counts,
                None,
                count_reports(comparison).proportion(Outcome.FALSE_CONTACT),
            )
        return self._counted[frame_spec.text]

    def _at_every_frame(self, spec: DetectorSpec) -> Detection:
        """Return what the pieces of a detector report at every frame."""
        pieces = {key: value for key, value in spec.settings.items() if key in REPLACED_SETTINGS}
        bodies = with_pieces(self._result.assembly.bodies, self._result.assembly.pairs, settings_of(spec.name, pieces))
        return self._verdicts.at_every_frame({body.name: body.colliders for body in bodies if body.colliders})

    def _errors_at_step(self, spec: DetectorSpec) -> Mapping[str, Any]:
        """Errors of pieces at the step of the detector, over all sampling offsets."""
        return wrong_counts(*self._counts_at_every_frame(spec), self._offset_counts(spec))

    def _offset_counts(self, spec: DetectorSpec) -> OffsetCounts:
        if self._offsets is None or self._offsets[0] != spec.text:
            frame_verdicts = self._at_every_frame(spec)
            self._offsets = spec.text, offset_counts(spec.settings["rate_hz"], frame_verdicts, self._reference)
        return self._offsets[1]

    def _without_new_misses(self, spec: DetectorSpec) -> DetectorSpec:
        """The same pieces in every frame, where their step makes something worse than before and every frame nothing.

        A filled hull is in contact all the time, so that no step of it misses a touch; pieces meet the touch alone.
        """
        if not has_offsets(spec, len(self._result.assembly.motion)) or not worse_text(
            *self._errors_of(self._errors_at_step(spec))
        ):
            return spec
        frame_counts = wrong_counts(*self._counts_at_every_frame(spec), None)
        is_better = frame_counts["loss"] < self._rank.loss and not worse_text(*self._errors_of(frame_counts))
        return _at_every_frame(spec) if is_better else spec

    def _figures(self, spec: DetectorSpec, names: Sequence[str]) -> _Measured:
        """The figures that ``run`` gives this detector."""
        frame_verdicts, rate_hz, offsets = self._at_every_frame(spec), spec.settings.get("rate_hz"), None
        if has_offsets(spec, len(frame_verdicts.times)):
            offsets = self._offset_counts(spec)
        typical_offset = 0.0 if offsets is None else offsets.typical_offset
        sampled_detection = sampled_at_rate(frame_verdicts, rate_hz, spec.settings.get(OFFSET_SETTING, typical_offset))
        comparison = self._reference.compare(sampled_detection)
        sampled_counts = count_contacts(comparison, self._reference.contacts)
        false_contact = count_reports(comparison).proportion(Outcome.FALSE_CONTACT)
        run = self._run_over_stretches(spec)
        wrong_count_columns = wrong_counts(sampled_counts, None, false_contact, offsets)
        solids: Mapping[str, Any] = getattr(run.detector, "parts", {})
        pieces = {name: len(solids[name]) for name in names}
        proportions = offsets.proportions() if offsets is not None else _proportions(sampled_counts)
        times = sample_times(run.detection, rate_hz)
        figures = FixFigures(
            what=_pieces_label(sum(pieces.values()), rate_hz),
            missed=proportions["contacts_missed"],
            late_or_cut_short=proportions["contacts_in_part"],
            time_missed=proportions["missed"],
            false=false_contact if offsets is None else offsets.false_contact,
            missed_counts=_range(wrong_count_columns, "missed"),
            late_counts=_range(wrong_count_columns, "late"),
            offsets=1 if offsets is None else OFFSET_COUNT,
            mean=run.seconds_per_frame,
            p99=None if times is None else times.p99,
            spans=_lane_spans(comparison, self._reference.contacts, frame_verdicts.times),
        )
        return _Measured(
            spec=spec,
            counts=wrong_count_columns,
            seconds=run.seconds_per_frame,
            busy=busy_sentence(0.0 if run.processor_fraction is None else 1.0 - run.processor_fraction),
            pieces=pieces,
            figures=figures,
        )

    def _run_over_stretches(self, spec: DetectorSpec) -> Run:
        """A run of a detector over stretches that are spread evenly over the motion, live where its own run was."""
        motion, live = self._result.assembly.motion, self._result.document.detectors[self._rank.label].live
        assembly = replace(self._result.assembly, motion=motion.take(timed_frames(len(motion))))
        return run_detector(spec, assembly, seed=self._seed, faces=False, advance=lambda _: None, live=live)

    def _change(self, measured: _Measured) -> str:
        """``False 86 % -> 19 %, but missed 0-1 -> 0-2 (of 18); 0.02 ms a frame more``, no time if busy."""
        return change_text(*self._errors(measured))

    def _errors(self, measured: _Measured) -> tuple[Errors, Errors]:
        """Errors of the detector as it is and with pieces; without times where one of them is of a busy machine."""
        is_idle = not (busy_text(self._result.document) or measured.busy)
        seconds_before, seconds_after = (self._rank.mean, measured.seconds) if is_idle else (None, None)
        return self._errors_of(measured.counts, seconds_before, seconds_after)

    def _errors_of(
        self,
        wrong_count_columns: Mapping[str, Any],
        seconds_before: float | None = None,
        seconds_after: float | None = None,
    ) -> tuple[Errors, Errors]:
        """Errors of the detector as it is and of pieces with these counts, and their seconds a frame."""
        return errors_of_rank(self._rank, seconds_before), errors_of_row(
            wrong_count_columns, self._rank.contacts, seconds_after
        )


MOST_SPANS: Final = 4000
"""Spans of a Fix that are kept: a lane has no room for more."""


def _lane_spans(
    comparison: Comparison, contacts: Sequence[Episode], times: FloatArray
) -> dict[str, tuple[tuple[float, float], ...]]:
    """Seconds in which any pair is right, missed, late or cut short, or false; empty where there are very many."""
    outcome, by_contact = comparison.outcome, comparison.by_contact
    masks = {
        "right": (outcome == Outcome.BOTH).any(axis=1),
        "false": (outcome == Outcome.FALSE_CONTACT).any(axis=1),
        **{kind: np.zeros(len(times), dtype=np.bool_) for kind in ("missed", "late")},
    }
    for contact in contacts:
        frames = slice(contact.first, contact.last + 1)
        column = by_contact[frames, contact.pair]
        masks["late" if (column == Outcome.BOTH).any() else "missed"][frames] |= column == Outcome.MISSED
    ends = np.append(times[1:], times[-1:])
    spans = {
        kind: tuple((float(times[first]), float(ends[last])) for _, first, last in column_runs([mask]))
        for kind, mask in masks.items()
    }
    return spans if sum(map(len, spans.values())) <= MOST_SPANS else {}


def timed_frames(frames: int) -> IntArray:
    """Numbers of the frames in which pieces are timed."""
    if frames <= TIMED_FRAMES:
        return np.arange(frames)
    length = TIMED_FRAMES // TIMED_SEGMENTS
    first_frames = np.linspace(0, frames - length, TIMED_SEGMENTS).astype(np.int64)
    return (first_frames[:, None] + np.arange(length)).ravel()


def _at_every_frame(spec: DetectorSpec) -> DetectorSpec:
    """The detector without a step."""
    return replace(spec, settings={key: value for key, value in spec.settings.items() if key != "rate_hz"})


def _proportions(frame_counts: ContactCounts) -> Proportions:
    """Shares of the contacts of a detector that has no sampling offsets."""
    return {
        "contacts_missed": proportion(frame_counts.missed, frame_counts.contacts),
        "contacts_in_part": proportion(frame_counts.late_or_cut_short, frame_counts.contacts),
        "missed": frame_counts.proportion(Outcome.MISSED),
    }


def _range(wrong_count_columns: Mapping[str, Any], count_name: str) -> tuple[int, int]:
    """Smallest and largest count over the sampling offsets."""
    return round(wrong_count_columns[f"{count_name}_smallest"]), round(wrong_count_columns[f"{count_name}_largest"])


def _pieces_text(pieces: Mapping[str, int]) -> str:
    """``beaker and flask into 16 convex pieces each``; ``beaker into 12 and flask into 16 convex pieces``."""
    counts = [*pieces.values()]
    if len({*counts}) == 1:
        each = " each" if len(counts) > 1 else ""
        return f"{joined_names([*pieces])} into {plural(counts[0], 'convex piece')}{each}"
    return f"{joined_names([f'{name} into {count}' for name, count in pieces.items()])} convex pieces"


def _pieces_label(pieces: int, rate_hz: float | None) -> str:
    """``32 convex pieces at 50 Hz``; ``32 convex pieces, every frame``."""
    rate_text = f" at {rate(rate_hz)}" if rate_hz else ", every frame"
    return f"{plural(pieces, 'convex piece')}{rate_text}"


def _fewest_enough(loss_of_count: Mapping[int, float]) -> int:
    """The fewest pieces whose loss is hardly more than the smallest one."""
    accepted_loss = min(loss_of_count.values()) + ACCEPTED_EXTRA_LOSS
    return min(piece_count for piece_count, loss in loss_of_count.items() if loss <= accepted_loss)


def _why_not_cut(mesh: TriangleMesh) -> str:
    """Why a mesh keeps its hull, as the end of a sentence; ``""``: it can be cut, or is convex."""
    reason = why_not_cut(mesh)
    if reason or _is_convex(mesh):
        return reason
    return Cut(mesh, "auto", FIRST_PIECE_COUNT).row.not_installed


def _is_convex(mesh: TriangleMesh) -> bool:
    hull = hull_collider(mesh)
    return abs(volume_of(mesh)) >= SOLID_HULL_FRACTION * volume_of(hull)
