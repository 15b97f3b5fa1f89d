"""The open assumptions of a recording as questions: what each alternative would change, found by replaying it.

Every alternative is asked of the exact detector on all frames, or on evenly chosen ones of a long recording. One whose
contacts are those of another is not shown apart; a question with one answer left is none.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cdcore.errors import CollisionCoreError
from cdcore.numerics import IntArray
from replay import words
from replay.advice.open_guesses import (
    DECISION_HINT,
    MOST_QUESTIONS,
    guess_lines,
    open_rows,
    untried_lines,
    untried_rows,
)
from replay.advice.plausibility import more_plausible, plausible_length_unit
from replay.advice.rereading import Rereadings
from replay.advice.sampled_contacts import MOST_FRAMES, best_fitting_axes, collider_misfit
from replay.advice.scene_outcome import Outcome, outcome_text
from replay.detection.progress import Progress, Silent
from replay.engine import prepare
from replay.errors import ReplayError
from replay.prepare.assembly import Assembly
from sessions import Session
from sessions.errors import SessionError
from sessions.model.assumption import Assumption, Subject
from sessions.scene_files.answers import recording_assumptions, with_answer
from sessions.scene_files.pose_axes import follows_its_poses


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
        """Evidence in the recording: its contacts, or how colliders fit their meshes."""
        if self.overshoot is None:
            return outcome_text(self.outcome)
        return f"colliders up to {words.decimal(1e3 * self.overshoot, 0)} mm off the bounds of their meshes"


@dataclass(frozen=True, eq=False)
class Question:
    """An open assumption whose alternatives answer differently.

    ``plausible``: the value of the more plausible alternative; ``""``: none is.
    """

    assumption: Assumption
    alternatives: tuple[Alternative, ...]
    plausible: str


@dataclass(frozen=True, eq=False)
class AssumptionReview:
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

    @property
    def sampled(self) -> Assembly:
        """The assembly in the frames that were asked."""
        whole_assembly, frames = self.assembly, self.frames
        return replace(
            whole_assembly,
            motion=whole_assembly.motion.take(frames),
            stamp_ns=whole_assembly.stamp_ns[frames],
            origin=whole_assembly.origin[frames],
        )


def examine_assumptions(
    session: Session,
    assembly: Assembly | None = None,
    progress: Progress | None = None,
    rows: Sequence[Assumption] | None = None,
) -> AssumptionReview:
    """Replays a recording under every alternative of its open assumptions.

    ``assembly``: the recording as it is, ready for detection; ``None``: it is made here. ``rows``: the assumptions to
    try; ``None``: all that are open.

    Raises ``ReplayError``, ``CollisionCoreError``, ``SessionError``: it cannot be replayed as it is.
    """
    progress = progress or Silent()
    whole_assembly = assembly if assembly is not None else prepare(session, progress=progress).assembly
    frames = chosen_frames(len(whole_assembly.motion))
    rereadings = Rereadings(session, whole_assembly, frames)
    rows = open_rows(session) if rows is None else rows
    outcome_count = 1 + sum(len(row.alternatives) - 1 for row in rows)
    with progress.stage("Trying what the files do not say", outcome_count, "alternatives") as advance:
        current_outcome = rereadings.current()
        advance(1)
        questions = []
        for row in rows:
            if row.subject is Subject.COLLIDER_AXES:
                questions += collider_questions(session, row, current_outcome)
                advance(len(row.alternatives) - 1)
                continue
            alternatives = []
            for value in dict.fromkeys((row.value, *row.alternatives)):
                if value == row.value:
                    alternatives.append(
                        Alternative(value, assumption_text(session, row, value), current_outcome, is_current=True)
                    )
                    continue
                changed_session = with_answer(session, row, value)
                description = assumption_text(changed_session, row, value)
                if row.subject is Subject.POSE_AXES and follows_its_poses(session, changed_session):
                    outcome = current_outcome
                else:
                    outcome = rereadings.outcome(changed_session, row)
                alternatives.append(Alternative(value, description, outcome, is_current=False))
                advance(1)
            different_alternatives = _different(alternatives)
            if len(different_alternatives) > 1:
                questions.append(
                    Question(row, different_alternatives, _plausible(session, row, different_alternatives))
                )
    return AssumptionReview(session, whole_assembly, frames, current_outcome, tuple(questions[:MOST_QUESTIONS]))


def _plausible(session: Session, row: Assumption, alternatives: Sequence[Alternative]) -> str:
    """The value of the alternative that is clearly more plausible, or ``""``."""
    outcome_of_value = {alternative.value: alternative.outcome for alternative in alternatives}
    if row.subject is not Subject.LENGTH_UNIT:
        return more_plausible(outcome_of_value)
    unit = plausible_length_unit(session, row)
    return unit if unit in outcome_of_value else ""


def collider_questions(session: Session, row: Assumption, current_outcome: Outcome) -> list[Question]:
    """Returns the question on the axes of colliders, where others than those assumed fit the meshes clearly better."""
    best_axes = best_fitting_axes(session, row)
    if best_axes == row.value:
        return []
    alternatives = []
    for value in dict.fromkeys((row.value, *row.alternatives)):
        is_current = value == row.value
        changed_session = session if is_current else with_answer(session, row, value)
        alternatives.append(
            Alternative(
                value,
                assumption_text(changed_session, row, value),
                current_outcome,
                is_current,
                overshoot=collider_misfit(changed_session, row.bodies),
            )
        )
    return [Question(row, tuple(alternatives), best_axes)]


def chosen_frames(frame_count: int) -> IntArray:
    """Returns the numbers of the frames to ask, in order."""
    return np.unique(np.linspace(0, frame_count - 1, min(frame_count, MOST_FRAMES)).round().astype(np.int64))


def assumption_text(changed_session: Session, row: Assumption, value: str) -> str:
    """The words of the assumption as it stands in a changed recording."""
    if row.subject is Subject.LENGTH_UNIT:
        return f"lengths in {value}"
    if row.subject is Subject.MESH_UNIT:
        return f"drawn in {value}"
    for other_assumption in recording_assumptions(changed_session):
        if (
            other_assumption.subject is row.subject
            and other_assumption.files == row.files
            and other_assumption.bodies == row.bodies
        ):
            if row.subject is Subject.POSE_AXES:
                return f"{value} ({other_assumption.description})"
            return other_assumption.description or value
    return value


def _different(alternatives: Sequence[Alternative]) -> tuple[Alternative, ...]:
    """The first of those that answer alike, in order."""
    kept_alternatives: list[Alternative] = []
    for alternative in alternatives:
        if not any(
            np.array_equal(alternative.outcome.contact, kept_alternative.outcome.contact)
            for kept_alternative in kept_alternatives
        ):
            kept_alternatives.append(alternative)
    return tuple(kept_alternatives)


def sentences_of(question: Question) -> Iterator[str]:
    """Yields a line for each alternative: what it is and what the recording shows then."""
    for alternative in question.alternatives:
        yield f"{alternative.description}: {alternative.words}"


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
    untried_sentences = untried_lines(session)
    rows_not_tried = untried_rows(session)
    rows = open_rows(session)
    if not rows:
        return GuessLines(untried_sentences, guess_lines(session, rows_not_tried))
    try:
        review = examine_assumptions(session, assembly, progress)
    except (ReplayError, CollisionCoreError, SessionError) as error:
        failed_sentences = [
            f"Not decided, and not tried ({error}): {row.title_by_bodies}. {DECISION_HINT}" for row in rows
        ]
        return GuessLines([*untried_sentences, *failed_sentences], guess_lines(session, [*rows_not_tried, *rows]))
    questions = [f"{question_sentence(question)} {DECISION_HINT}" for question in review.questions]
    open_assumptions = [question.assumption for question in review.questions]
    return GuessLines([*untried_sentences, *questions], guess_lines(session, [*rows_not_tried, *open_assumptions]))


def question_sentence(question: Question) -> str:
    """Returns a question with what each alternative would show, without the names of files."""
    joined_alternatives = "; ".join(sentences_of(question))
    return (
        f"Not decided: {question.assumption.title_by_bodies}. "
        f"{joined_alternatives[:1].upper()}{joined_alternatives[1:]}."
    )
