"""Sentences on what an import guessed: what its user may decide, and what was taken for sure; nothing is replayed."""

from collections.abc import Collection, Sequence
from typing import Final

from replay.document.placeholders import RECORDING
from replay.words import plural
from sessions import Session
from sessions.model.assumption import DRAFTED, Assumption, Confidence, Origin, Subject
from sessions.scene_files.answers import CHANGEABLE, OPTIONS, recording_assumptions

MOST_QUESTIONS: Final = 3

MOST_NAMED: Final = 4
"""Sessions that a sentence names."""

DECISION_HINT: Final = f"To decide: replay doctor {RECORDING} --look"

GUESSED_SUBJECTS: Final = (Subject.POSE_AXES, Subject.LENGTH_UNIT, Subject.MESH_UNIT, *DRAFTED)
"""What the first screen of a run names where it was guessed."""


def open_rows(session: Session) -> list[Assumption]:
    """Returns the open assumptions of a recording whose alternatives can be tried on it."""
    return [row for row in recording_assumptions(session) if row.is_open and row.subject in CHANGEABLE]


def untried_lines(session: Session) -> list[str]:
    """Returns a sentence for each open assumption whose alternatives only another import can show."""
    return [
        f"Not decided: {row.title_by_bodies}. Taken for {row.value}: {row.reason}. To decide: "
        f"{OPTIONS.get(row.subject, 'the mapping')} ({' or '.join(row.alternatives)}), and import again."
        for row in untried_rows(session)
    ]


def untried_rows(session: Session) -> list[Assumption]:
    """Returns the open assumptions of a recording whose alternatives only another import can show."""
    return [row for row in recording_assumptions(session) if row.is_open and row.subject not in CHANGEABLE]


def guess_lines(session: Session, questions: Collection[Assumption] = ()) -> list[str]:
    """Returns one sentence on what an import guessed of poses and clock, or none; ``questions`` have their own."""
    rows = [
        row
        for row in recording_assumptions(session)
        if row.origin is Origin.GUESS and row.subject in GUESSED_SUBJECTS and row not in questions
    ]
    if not rows:
        return []
    guess_texts = "; ".join(
        f"{row.title_by_bodies} ({row.value}{', not sure' if row.confidence is Confidence.OPEN else ''})"
        for row in rows
    )
    return [f"Guessed by the import: {guess_texts}. Why: replay info {RECORDING} -v"]


def undecided_sentence(row: Assumption, path: str) -> str:
    """Returns an open assumption with its alternatives, how to see what each would change, and how to decide."""
    alternatives = [value for value in row.alternatives if value != row.value]
    option = OPTIONS.get(row.subject, "the mapping")
    return (
        f"Not decided: {row.title}. Taken for {row.value}; others: {', '.join(alternatives)}. To see what each would "
        f"change: replay doctor {path} --look. To decide: {option} when you import it"
    )


def open_guesses_line(undecided_sessions: Sequence[str], count: int) -> list[str]:
    """Returns the line on sessions whose import guessed something that changes their contacts; none of none."""
    if not undecided_sessions:
        return []
    session_names = ", ".join(undecided_sessions[:MOST_NAMED]) + (
        ", ..." if len(undecided_sessions) > MOST_NAMED else ""
    )
    return [
        f"Not decided: in {len(undecided_sessions)} of {plural(count, 'session')} a guess of the import changes "
        f"the contacts "
        f"({session_names}). To decide: replay doctor FILE.mcap --look"
    ]
