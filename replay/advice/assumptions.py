"""The open assumptions of a recording as questions: what each alternative would change, found by replaying it.

Every alternative is asked of the exact detector on all frames, or on evenly chosen ones of a long recording. One whose
contacts are those of another is not shown apart; a question with one answer left is none.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cdcore import Motion
from cdcore.errors import CollisionCoreError
from cdcore.numerics import BoolArray, FloatArray, IntArray
from cdcore.protocol import counts_as_contact
from replay.advice.open_guesses import (
    DECIDE,
    MOST_QUESTIONS,
    guess_lines,
    open_rows,
    untried_lines,
    untried_rows,
)
from replay.advice.overlap_depth import SampledSurface, overlap_depth
from replay.advice.sampled_contacts import MOST_FRAMES, best_fitting_axes, collider_misfit
from replay.advice.shared_motion import shared_motion
from replay.auditing.episodes import episodes
from replay.detection.detector_spec import DetectorSpec
from replay.detection.run_detector import make_detector
from replay.engine import prepared
from replay.errors import ReplayError
from replay.prepare.assemble import body_of
from replay.prepare.assembly import Assembly
from replay.progress import Progress, Silent
from replay.words import length, plural
from sessions import Session
from sessions.errors import SessionError
from sessions.model.assumption import Assumption, Subject
from sessions.scene_files.answers import answered, recording_assumptions
from sessions.scene_files.pose_axes import follows_its_poses

DEPTH_FRAMES: Final = 24
"""Contact frames of an alternative whose depth is measured, evenly chosen."""

DEEP_M: Final = 0.005
"""A body that stands deeper in another is no body that rests: glass is thinner, and trackers err by less."""

VERY_DEEP_M: Final = 0.02
"""Deeper overlaps speak against a scene more than none that touches does."""

GAP_FRAMES: Final = 48
"""Frames without contact whose gap is measured, of each pair those of the nearest bodies."""

MESH_SUBJECTS: Final = (Subject.MESH_AXES, Subject.MESH_UNIT)


@dataclass(frozen=True, eq=False)
class Outcome:
    """The contacts of a recording under one assumption.

    Parameters
    ----------
    contacts : how many there are; ``contact`` (T, P) where.
    deepest : metres that bodies stand in each other at most.
    closest : metres between two bodies at most; 0 with a contact, ``None``: not measured.
    closest_frame : the frame of the closest moment, and its pair.
    touched : bodies that touch another at any time.
    supported : bodies that touch another while both rest.
    carried_contact : fraction with contact of the frames in which two bodies move as one.
    """

    contacts: int
    contact: BoolArray
    deepest: float
    closest: float | None
    closest_frame: int
    closest_pair: int
    touched: int
    supported: int = 0
    carried_contact: float = 0.0


@dataclass(frozen=True, eq=False)
class Alternative:
    """A value that an assumption may have, and what the recording shows then."""

    value: str
    description: str
    outcome: Outcome
    is_current: bool
    overshoot: float | None = None
    """Metres that colliders reach beyond or stay within the bounds of their meshes at most; ``None``: of meshes."""

    @property
    def words(self) -> str:
        """What the recording shows: its contacts, or how colliders fit their meshes."""
        if self.overshoot is None:
            return outcome_words(self.outcome)
        return f"colliders up to {1e3 * self.overshoot:.0f} mm off the bounds of their meshes"


@dataclass(frozen=True, eq=False)
class Question:
    """An open assumption whose alternatives answer differently.

    ``plausible``: the value of the more plausible alternative; ``""``: none is.
    """

    assumption: Assumption
    alternatives: tuple[Alternative, ...]
    plausible: str


@dataclass(frozen=True, eq=False)
class Examined:
    """A recording as it is, and what is to be asked of it.

    ``frames``: numbers of the frames that were asked, of all of the assembly.
    """

    session: Session
    assembly: Assembly
    frames: IntArray
    outcome: Outcome
    questions: tuple[Question, ...]

    @property
    def is_thinned(self) -> bool:
        """Whether not every frame was asked."""
        return len(self.frames) < len(self.assembly.motion)


def examine_assumptions(
    session: Session,
    assembly: Assembly | None = None,
    progress: Progress | None = None,
    rows: Sequence[Assumption] | None = None,
) -> Examined:
    """Replays a recording under every alternative of its open assumptions.

    ``assembly``: the recording as it is, ready for detection; ``None``: it is made here. ``rows``: the assumptions to
    try; ``None``: all that are open.

    Raises ``ReplayError``, ``CollisionCoreError``, ``SessionError``: it cannot be replayed as it is.
    """
    progress = progress or Silent()
    whole = assembly if assembly is not None else prepared(session, progress=progress).assembly
    frames = chosen_frames(len(whole.motion))
    thinned = whole.motion.take(frames)
    rows = open_rows(session) if rows is None else rows
    total = 1 + sum(len(row.alternatives) - 1 for row in rows)
    with progress.stage("Trying what the files do not say", total, "alternatives") as advance:
        current = outcome_of(replace(whole, motion=thinned))
        advance(1)
        questions = []
        for row in rows:
            if row.subject is Subject.COLLIDER_AXES:
                questions += collider_questions(session, row, current)
                advance(len(row.alternatives) - 1)
                continue
            alternatives = []
            for value in dict.fromkeys((row.value, *row.alternatives)):
                if value == row.value:
                    alternatives.append(Alternative(value, _described(session, row, value), current, is_current=True))
                    continue
                changed = answered(session, row, value)
                description = _described(changed, row, value)
                if row.subject is Subject.POSE_AXES and follows_its_poses(session, changed):
                    outcome = current
                else:
                    outcome = outcome_of(_assembled(changed, row, whole, thinned, frames))
                alternatives.append(Alternative(value, description, outcome, is_current=False))
                advance(1)
            different = _different(alternatives)
            if len(different) > 1:
                questions.append(Question(row, different, more_plausible(different)))
    return Examined(session, whole, frames, current, tuple(questions[:MOST_QUESTIONS]))


def collider_questions(session: Session, row: Assumption, current: Outcome) -> list[Question]:
    """Returns the question on the axes of colliders, where others than those assumed fit the meshes clearly better."""
    best = best_fitting_axes(session, row)
    if best == row.value:
        return []
    alternatives = []
    for value in dict.fromkeys((row.value, *row.alternatives)):
        changed = session if value == row.value else answered(session, row, value)
        description = row.description if value == row.value else _described(changed, row, value)
        alternatives.append(
            Alternative(value, description, current, value == row.value, overshoot=collider_misfit(changed, row.bodies))
        )
    return [Question(row, tuple(alternatives), best)]


def chosen_frames(count: int) -> IntArray:
    """Returns the numbers of the frames to ask, in order."""
    return np.unique(np.linspace(0, count - 1, min(count, MOST_FRAMES)).round().astype(np.int64))


def _described(changed: Session, row: Assumption, value: str) -> str:
    """The words of the assumption as it stands in a changed recording."""
    for other in recording_assumptions(changed):
        if other.subject is row.subject and other.files == row.files and other.bodies == row.bodies:
            if row.subject is Subject.POSE_AXES:
                return f"{value} ({other.description})"
            return other.description or value
    return value


def _assembled(changed: Session, row: Assumption, whole: Assembly, thinned: Motion, frames: IntArray) -> Assembly:
    """The changed recording ready for detection; of meshes alone the poses are those there are."""
    if row.subject in MESH_SUBJECTS:
        bodies = tuple(body_of(changed, body.name) if body.name in row.bodies else body for body in whole.bodies)
        return replace(whole, bodies=bodies, motion=thinned)
    again = prepared(changed).assembly
    return replace(again, motion=again.motion.take(frames[frames < len(again.motion)]))


def _different(alternatives: Sequence[Alternative]) -> tuple[Alternative, ...]:
    """The first of those that answer alike, in order."""
    kept: list[Alternative] = []
    for alternative in alternatives:
        if not any(np.array_equal(alternative.outcome.contact, other.outcome.contact) for other in kept):
            kept.append(alternative)
    return tuple(kept)


def outcome_of(assembly: Assembly) -> Outcome:
    """Returns the contacts of an assembly by the exact detector, their depth, and how near bodies come without one."""
    motion = assembly.motion
    detector = make_detector(DetectorSpec("exact", "exact"), assembly, 0)
    detection = detector.detect(motion)
    contact = counts_as_contact(detection.verdict)
    deepest, deep_frame = _depths(assembly, contact)
    closest, frame, pair = (0.0, *deep_frame) if contact.any() else _closest(assembly)
    shared = shared_motion(motion, assembly.pairs)
    touched = {body for column in np.flatnonzero(contact.any(axis=0)) for body in assembly.pairs[column].tolist()}
    return Outcome(
        contacts=len(episodes(detection, motion.valid, assembly.contact_columns)),
        contact=contact,
        deepest=deepest,
        closest=closest,
        closest_frame=frame,
        closest_pair=pair,
        touched=len(touched),
        supported=shared.supported(contact, assembly.pairs),
        carried_contact=shared.carried_contact(contact),
    )


def _depths(assembly: Assembly, contact: BoolArray) -> tuple[float, tuple[int, int]]:
    """Metres of the deepest overlap among frames that are evenly chosen, its frame and its pair."""
    frames, pairs = np.nonzero(contact)
    if not len(frames):
        return 0.0, (0, 0)
    chosen = np.unique(np.linspace(0, len(frames) - 1, min(len(frames), DEPTH_FRAMES)).round().astype(np.int64))
    # Pair by pair, so that each pair is among those chosen.
    order = np.lexsort((frames, pairs))
    surfaces: dict[int, SampledSurface] = {}
    depths = []
    for row in order[chosen].tolist():
        first, second = assembly.pairs[pairs[row]].tolist()
        for body in (first, second):
            surfaces.setdefault(body, SampledSurface(assembly.bodies[body].mesh))
        depths.append(
            overlap_depth(surfaces[first], surfaces[second], assembly.motion, int(frames[row]), (first, second))
        )
    deepest = int(np.argmax(depths))
    row = int(order[chosen[deepest]])
    return depths[deepest], (int(frames[row]), int(pairs[row]))


def _closest(assembly: Assembly) -> tuple[float | None, int, int]:
    """Metres of the smallest gap among the frames in which two bodies are nearest, its frame and its pair."""
    from cdcore.narrow.mesh_stage import MeshStage

    stage, motion = MeshStage(assembly.bodies, assembly.pairs), assembly.motion
    best: tuple[float | None, int, int] = None, 0, 0
    most = max(1, GAP_FRAMES // len(assembly.pairs)) if len(assembly.pairs) else 0
    for pair, (first, second) in enumerate(assembly.pairs.tolist()):
        both = np.flatnonzero(motion.valid[:, first] & motion.valid[:, second])
        for frame in both[_nearest(assembly, both, first, second, most)].tolist():
            gap, _ = stage.gap(motion, frame, pair)
            if best[0] is None or gap < best[0]:
                best = gap, frame, pair
    return best


def _nearest(assembly: Assembly, frames: IntArray, first: int, second: int, most: int) -> IntArray:
    """Rows of the frames in which the middles of two bodies are nearest."""
    middles: list[FloatArray] = []
    for body in (first, second):
        local = assembly.bodies[body].mesh.vertices.mean(axis=0)
        motion = assembly.motion
        middles.append(motion.rotations[frames, body] @ local + motion.translations[frames, body])
    order: IntArray = np.argsort(np.linalg.norm(middles[0] - middles[1], axis=1), kind="stable")
    return order[:most]


def more_plausible(alternatives: Sequence[Alternative]) -> str:
    """Returns the value of the alternative that is clearly more like a real scene, or ``""``.

    Bodies that touch and are not deep in each other speak for it; that nothing touches, or bodies deep in each other,
    against it. Of two that are alike in this, contact of bodies that move as one speaks for it, then bodies that touch
    where they rest, then bodies that touch at all. Two that are alike in all of these are as plausible.
    """
    ranked = sorted(alternatives, key=_implausibility)
    first, second = _implausibility(ranked[0]), _implausibility(ranked[1])
    return ranked[0].value if first < second else ""


def _implausibility(alternative: Alternative) -> tuple[int, float, int, int]:
    outcome = alternative.outcome
    level = 0
    if outcome.deepest > VERY_DEEP_M:
        level = 2
    elif outcome.deepest > DEEP_M or not outcome.contacts:
        level = 1
    # By tenths: of two that differ by a few frames none is more like a real scene.
    return level, -round(outcome.carried_contact, 1), -outcome.supported, -outcome.touched


def sentences_of(question: Question) -> Iterator[str]:
    """Yields a line for each alternative: what it is and what the recording shows then."""
    for alternative in question.alternatives:
        yield f"{alternative.description}: {alternative.words}"


def outcome_words(outcome: Outcome) -> str:
    """Returns what a recording shows: ``3 contacts, bodies up to 40 mm deep in each other``."""
    if not outcome.contacts:
        nearest = "" if outcome.closest is None else f", {length(outcome.closest)} at the closest"
        return f"no contact{nearest}"
    contacts = plural(outcome.contacts, "contact")
    if outcome.deepest > DEEP_M:
        return f"{contacts}, bodies up to {1e3 * outcome.deepest:.0f} mm deep in each other"
    return f"{contacts}, at most {max(1.0, np.ceil(1e3 * outcome.deepest)):.0f} mm deep"


@dataclass(frozen=True)
class GuessLines:
    """Sentences for the first screen of a run: open questions of its recording, and what was guessed besides."""

    questions: list[str]
    guesses: list[str]


def first_screen_lines(session: Session, assembly: Assembly | None, progress: Progress) -> GuessLines:
    """Returns the open questions of a recording, and in one more sentence everything else that its import guessed.

    ``assembly``: the recording as it was replayed; ``None``: it is made here. No file is named, since files may be
    called after people.
    """
    untried = untried_lines(session)
    said = untried_rows(session)
    rows = open_rows(session)
    if not rows:
        return GuessLines(untried, guess_lines(session, said))
    try:
        examined = examine_assumptions(session, assembly, progress)
    except (ReplayError, CollisionCoreError, SessionError) as error:
        failed = [f"Not decided, and not tried ({error}): {row.title_by_bodies}. {DECIDE}" for row in rows]
        return GuessLines([*untried, *failed], guess_lines(session, [*said, *rows]))
    questions = [f"{question_sentence(question)} {DECIDE}" for question in examined.questions]
    asked = [question.assumption for question in examined.questions]
    return GuessLines([*untried, *questions], guess_lines(session, [*said, *asked]))


def question_sentence(question: Question) -> str:
    """Returns a question with what each alternative would show, without the names of files."""
    joined = "; ".join(sentences_of(question))
    return f"Not decided: {question.assumption.title_by_bodies}. {joined[:1].upper()}{joined[1:]}."
