"""``replay doctor --look`` and the end of ``replay import``: pictures of a recording, and what its import guessed."""

import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from string import ascii_lowercase
from typing import TYPE_CHECKING, Any, Final

import click

from replay.cli.console import EXIT_DATA_LOSS, EXIT_OK, People, TerminalProgress, answer
from replay.words import plural

if TYPE_CHECKING:
    from rich.console import RenderableType

    from replay.advice.assumptions import AssumptionReview, Question
    from sessions import Session
    from sessions.model.assumption import Assumption

FOLDER_SUFFIX: Final = "-look"
PICTURE_FILE: Final = "look.rrd"
LEAVE_OPEN: Final = "leave open"

Answers = Mapping[int, int]
"""Number of a question, from 0 -> number of the alternative."""


def parse_answers(texts: Sequence[str]) -> Answers:
    """Returns the answers of texts such as ``1b``: the second alternative of the first question."""
    answers = {}
    for text in texts:
        question_number, alternative_letter = text[:-1], text[-1:].lower()
        if not question_number.isdigit() or int(question_number) < 1 or alternative_letter not in ascii_lowercase:
            raise click.BadParameter(f"{text!r} is not a question and a letter, such as 1b", param_hint="--answer")
        answers[int(question_number) - 1] = ascii_lowercase.index(alternative_letter)
    return answers


def decide_in_pipe(session: "Session", path: Path, people: People) -> int:
    """Say which guesses of an import change its contacts, and the option that decides each; the exit code.

    Most of them are decided without a replay. A recording that cannot be replayed has no contacts that they
    could change; then their names are said alone.
    """
    from replay.advice.open_guesses import MOST_QUESTIONS, open_rows, undecided_sentence, untried_lines
    from replay.advice.sampled_contacts import alternatives_differ

    undecided_lines = untried_lines(session)
    untested_titles = []
    for row in open_rows(session):
        are_different = alternatives_differ(session, row)
        if are_different:
            undecided_lines.append(undecided_sentence(row, str(path)))
        elif are_different is None:
            untested_titles.append(row)
    if untested_titles:
        undecided_lines += _replayed_sentences(session, untested_titles, path, people)
    people.say(*undecided_lines[:MOST_QUESTIONS])
    return EXIT_DATA_LOSS if undecided_lines else EXIT_OK


def _replayed_sentences(session: "Session", rows: "Sequence[Assumption]", path: Path, people: People) -> list[str]:
    """A sentence for each assumption that changes contacts, by replaying the recording under every alternative."""
    from cdcore.errors import CollisionCoreError
    from replay.advice.assumptions import examine_assumptions
    from replay.advice.open_guesses import undecided_sentence
    from replay.errors import ReplayError
    from sessions.errors import SessionError

    try:
        examined = examine_assumptions(session, progress=TerminalProgress(people), rows=rows)
    except (ReplayError, CollisionCoreError, SessionError):
        named = ", ".join(row.title for row in rows)
        people.say(f"not sure: {named}; to see what each would change: replay doctor {path} --look")
        return []
    return [undecided_sentence(question.assumption, str(path)) for question in examined.questions]


def look_at(
    path: Path,
    people: People,
    *,
    as_json: bool,
    given: Answers,
    asks: bool | None = None,
    mapping: Path | None = None,
) -> int:
    """Write pictures of a recording, ask what its import guessed, and write the answers into it; the exit code.

    ``given``: answers from the command line. ``asks``: whether to ask the rest; ``None``: on a terminal. ``mapping``:
    the file that gets the answers too.
    """
    from replay.advice.assumptions import examine_assumptions
    from sessions import read_session

    session = read_session(path)
    examined = examine_assumptions(session, progress=TerminalProgress(people))
    _check_answers(examined.questions, given)
    folder = path.with_name(path.stem + FOLDER_SUFFIX)
    pictures = _write_pictures(examined, folder, people)
    is_terminal = sys.stdin.isatty() and sys.stdout.isatty() and not as_json
    answer(as_json, _as_json(examined, pictures, given), lambda: _review_screen(examined, pictures, path))
    chosen = dict(given)
    if is_terminal if asks is None else asks:
        chosen |= _answers_of_a_person(examined.questions, given)
    if mapping is not None and chosen:
        session = _answers_kept_in_mapping(session, path, mapping, examined.questions, chosen, people)
    _keep_answers(session, path, examined.questions, chosen, people)
    undecided = [number for number in range(len(examined.questions)) if number not in chosen]
    for number in undecided:
        people.say(f"Not decided: question {number + 1}. {_deciding_option(examined.questions[number], number, path)}")
    return EXIT_DATA_LOSS if undecided else EXIT_OK


def forget_answers(path: Path, people: People, *, mapping: Path | None = None) -> int:
    """Undo all that answers wrote: in the recording, in its pictures, and in the mapping; the exit code.

    ``mapping``: the file that got the answers; ``None``: the one that the recording names.
    """
    from sessions import read_session, write_session
    from sessions.importers.mapping_answers import ANSWERED_MAPPING_FACT, forget_mapping_answers
    from sessions.scene_files.answers import with_answers_forgotten

    session = read_session(path)
    mapping_name = session.facts.get(ANSWERED_MAPPING_FACT, "")
    mapping = mapping or (path.parent / mapping_name if mapping_name else None)
    if mapping is not None and mapping.is_file():
        answer_count = forget_mapping_answers(mapping)
        answers = "1 line" if answer_count == 1 else f"{answer_count} lines"
        people.say(f"{mapping}: {answers} as before the answers" if answer_count else f"{mapping}: no answer to forget")
    elif mapping is not None:
        people.say(f"{mapping} got answers too and is not there; where it is now: --mapping FILE")
    session_without_answers, answer_count = with_answers_forgotten(session)
    if answer_count or mapping_name:
        facts = {key: text for key, text in session_without_answers.facts.items() if key != ANSWERED_MAPPING_FACT}
        write_session(replace(session_without_answers, facts=facts), path, overwrite=True)
        _renew_pictures(path, people)
    answers = "1 answer" if answer_count == 1 else f"{answer_count} answers"
    people.say(f"{path}: {answers} forgotten" if answer_count else f"{path}: no answer to forget")
    return EXIT_OK


def _renew_pictures(path: Path, people: People) -> None:
    """Draw the pictures of a recording again where there are any."""
    from cdcore.errors import CollisionCoreError
    from replay.advice.assumptions import examine_assumptions
    from replay.errors import ReplayError
    from sessions import read_session

    folder = path.with_name(path.stem + FOLDER_SUFFIX)
    if not folder.is_dir():
        return
    try:
        _write_pictures(examine_assumptions(read_session(path), rows=()), folder, people)
    except (ReplayError, CollisionCoreError) as error:
        people.say(f"note: the pictures in {folder} show the recording before the answers ({error})")


def _write_pictures(review: "AssumptionReview", folder: Path, people: People) -> list[Path]:
    """The pictures of three moments, and the recording for Rerun where that can be written."""
    from replay.show.rerun_log.scene_look import write_scene_recording
    from replay.show.scene_look import moments_to_show, write_scene_pictures

    outcome, scene, assembly = review.outcome, review.session.scene, review.sampled
    moments = moments_to_show(assembly, outcome.closest_frame, outcome.closest_pair)
    paths = write_scene_pictures(assembly, scene, moments, folder)
    try:
        write_scene_recording(assembly, scene, moments, folder / PICTURE_FILE)
        paths.append(folder / PICTURE_FILE)
    except (OSError, ImportError) as error:
        people.say(f"note: no {PICTURE_FILE} for Rerun ({error})")
    return paths


def _check_answers(questions: Sequence["Question"], given: Answers) -> None:
    for number, alternative in given.items():
        if number >= len(questions):
            verb = "is" if len(questions) == 1 else "are"
            number_text = f"there {verb} {plural(len(questions), 'question')}" if questions else "there is no question"
            raise click.BadParameter(
                f"{number + 1}{ascii_lowercase[alternative]}: {number_text}", param_hint="--answer"
            )
        if alternative >= len(questions[number].alternatives):
            allowed_answers = ", ".join(ascii_lowercase[: len(questions[number].alternatives)])
            raise click.BadParameter(f"question {number + 1} has the answers {allowed_answers}", param_hint="--answer")


def _as_json(review: "AssumptionReview", pictures: Sequence[Path], given: Answers) -> dict[str, Any]:
    questions = [
        {
            "question": question.assumption.title,
            "plausible": question.plausible,
            "answer": question.alternatives[given[number]].value if number in given else None,
            "alternatives": [
                {
                    "value": row.value,
                    "description": row.description,
                    "contacts": row.outcome.contacts,
                    "deepest_m": row.outcome.deepest,
                    "closest_m": row.outcome.closest,
                    "words": row.words,
                    "current": row.is_current,
                }
                for row in question.alternatives
            ],
        }
        for number, question in enumerate(review.questions)
    ]
    frames = {"frames": len(review.frames), "of": len(review.assembly.motion)}
    return {"pictures": [str(path) for path in pictures], "asked": frames, "questions": questions}


def _review_screen(review: "AssumptionReview", pictures: Sequence[Path], path: Path) -> "RenderableType":
    """The pictures, what the recording shows as it is, and each question with its alternatives."""
    from rich.text import Text

    from replay.advice.scene_outcome import outcome_text
    from replay.cli.terminal import Paragraph, stacked

    del path
    picture_names = ", ".join([str(pictures[0]), *(picture.name for picture in pictures[1:])])
    contents: list[RenderableType] = [Paragraph("", f"Is this your scene?  Pictures: {picture_names}")]
    sampled_note = ""
    if review.is_thinned:
        sampled_note = f" ({len(review.frames):,} of {len(review.assembly.motion):,} frames)"
    contents.append(Paragraph("", f"The recording as it is now: {outcome_text(review.outcome)}{sampled_note}."))
    if not review.questions:
        contents.append(Paragraph("", "Nothing that the import guessed changes its contacts."))
    for number, question in enumerate(review.questions, start=1):
        contents.append(Text())
        row = question.assumption
        reason_text = f": {row.reason}" if row.reason else ""
        label = f" {number} of {len(review.questions)}  "
        contents.append(Paragraph(label, f"{_with_capital(row.title)}; {row.origin}{reason_text}."))
        for letter, alternative in zip(ascii_lowercase, question.alternatives, strict=False):
            current_mark = [" (as it is now)"] if alternative.is_current else []
            current_mark += ["  more plausible"] if alternative.value == question.plausible else []
            description = f"{alternative.description}: {alternative.words}{''.join(current_mark)}"
            contents.append(Paragraph(f"         {letter}  ", description))
    return stacked(*contents)


def _with_capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _answers_of_a_person(questions: Sequence["Question"], given: Answers) -> dict[int, int]:
    """Reads the answers of a person on the terminal; Enter leaves a question open."""
    chosen_answers = {}
    for number, question in enumerate(questions):
        if number in given:
            continue
        answer_choices = ascii_lowercase[: len(question.alternatives)]
        while True:
            prompt = (
                f" {number + 1} of {len(questions)}  Which one? [{'/'.join(answer_choices)}/?; Enter: {LEAVE_OPEN}]"
            )
            reply = click.prompt(prompt, default="", show_default=False, prompt_suffix=" ").strip().lower()
            if not reply:
                break
            if len(reply) == 1 and reply in answer_choices:
                chosen_answers[number] = answer_choices.index(reply)
                break
            click.echo("      Choose the letter of the line that shows your scene: see the pictures.")
    return chosen_answers


def _keep_answers(
    session: "Session", path: Path, questions: Sequence["Question"], chosen_answers: Answers, people: People
) -> None:
    """Write the answers into the recording, and say how to undo them and how to give them to the next import."""
    from sessions import write_session
    from sessions.scene_files.answers import OPTIONS, with_answer

    if not chosen_answers:
        return
    changed_session = session
    for number, alternative in chosen_answers.items():
        value = questions[number].alternatives[alternative].value
        changed_session = with_answer(changed_session, questions[number].assumption, value)
        option = OPTIONS.get(questions[number].assumption.subject, "")
        if option.startswith("--"):
            people.say(f"To answer it when you import again: {option} {value!r}".replace("'", '"'))
    write_session(changed_session, path, overwrite=True)
    if any(
        not questions[number].alternatives[alternative].is_current for number, alternative in chosen_answers.items()
    ):
        _renew_pictures(path, people)
    people.say(f"Written to {path}. To undo: replay doctor {path} --forget-answers")


def _answers_kept_in_mapping(
    session: "Session",
    path: Path,
    mapping: Path,
    questions: Sequence["Question"],
    chosen_answers: Answers,
    people: People,
) -> "Session":
    """The recording with the mapping that got its answers, for the next import, among its facts."""
    from sessions.importers.mapping_answers import ANSWERED_MAPPING_FACT, write_answers

    answers = [
        (questions[number].assumption, questions[number].alternatives[alternative].value)
        for number, alternative in chosen_answers.items()
    ]
    keys = write_answers(mapping, answers)
    people.say(f"Written to {mapping}: {', '.join(keys)}")
    mapping_path = Path(os.path.relpath(mapping, path.parent)).as_posix()
    return replace(session, facts={**session.facts, ANSWERED_MAPPING_FACT: mapping_path})


def _deciding_option(question: "Question", number: int, path: Path) -> str:
    """The option that decides a question."""
    from sessions.scene_files.answers import OPTIONS

    answers = [f"{number + 1}{letter}" for letter in ascii_lowercase[: len(question.alternatives)]]
    option = OPTIONS.get(question.assumption.subject, "the mapping")
    *first, last = answers
    return f"To decide: replay doctor {path} --answer {', '.join(first)} or {last}; or {option} when you import it"
