"""``replay doctor --look`` and the end of ``replay import``: pictures of a recording, and what its import guessed."""

import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from string import ascii_lowercase
from typing import TYPE_CHECKING, Any, Final

import click

from replay.cli.console import DATA_LOSS, OK, People, TerminalProgress, answer

if TYPE_CHECKING:
    from rich.console import RenderableType

    from replay.advice.assumptions import AssumptionReview, Question
    from sessions import Session
    from sessions.model.assumption import Assumption

FOLDER_END: Final = "-look"
PICTURE: Final = "look.rrd"
LEAVE: Final = "leave open"

Answers = Mapping[int, int]
"""Number of a question, from 0 -> number of the alternative."""


def parse_answers(texts: Sequence[str]) -> Answers:
    """Returns the answers of texts such as ``1b``: the second alternative of the first question."""
    answers = {}
    for text in texts:
        number, letter = text[:-1], text[-1:].lower()
        if not number.isdigit() or int(number) < 1 or letter not in ascii_lowercase:
            raise click.BadParameter(f"{text!r} is not a question and a letter, such as 1b", param_hint="--answer")
        answers[int(number) - 1] = ascii_lowercase.index(letter)
    return answers


def decide_in_pipe(session: "Session", path: Path, people: People) -> int:
    """Say which guesses of an import change its contacts, and the option that decides each; the exit code.

    Most of them are decided without a replay. A recording that cannot be replayed has no contacts that they
    could change; then their names are said alone.
    """
    from replay.advice.open_guesses import MOST_QUESTIONS, open_rows, undecided_sentence, untried_lines
    from replay.advice.sampled_contacts import alternatives_differ

    undecided = untried_lines(session)
    untested = []
    for row in open_rows(session):
        differs = alternatives_differ(session, row)
        if differs:
            undecided.append(undecided_sentence(row, str(path)))
        elif differs is None:
            untested.append(row)
    if untested:
        undecided += _replayed_sentences(session, untested, path, people)
    people.say(*undecided[:MOST_QUESTIONS])
    return DATA_LOSS if undecided else OK


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
    folder = path.with_name(path.stem + FOLDER_END)
    pictures = _write_pictures(examined, folder, people)
    _check_answers(examined.questions, given)
    is_terminal = sys.stdin.isatty() and sys.stdout.isatty() and not as_json
    answer(as_json, _as_json(examined, pictures, given), lambda: _screen(examined, pictures, path))
    chosen = dict(given)
    if is_terminal if asks is None else asks:
        chosen |= _answers_of_a_person(examined.questions, given)
    if mapping is not None and chosen:
        session = _kept_in_mapping(session, path, mapping, examined.questions, chosen, people)
    _keep(session, path, examined.questions, chosen, people)
    undecided = [number for number in range(len(examined.questions)) if number not in chosen]
    for number in undecided:
        people.say(f"Not decided: question {number + 1}. {_decides(examined.questions[number], number, path)}")
    return DATA_LOSS if undecided else OK


def forget_answers(path: Path, people: People, *, mapping: Path | None = None) -> int:
    """Undo all that answers wrote: in the recording, in its pictures, and in the mapping; the exit code.

    ``mapping``: the file that got the answers; ``None``: the one that the recording names.
    """
    from sessions import read_session, write_session
    from sessions.importers.mapping_answers import ANSWERED_MAPPING_FACT, forget_mapping_answers
    from sessions.scene_files.answers import with_answers_forgotten

    session = read_session(path)
    named = session.facts.get(ANSWERED_MAPPING_FACT, "")
    mapping = mapping or (path.parent / named if named else None)
    if mapping is not None and mapping.is_file():
        count = forget_mapping_answers(mapping)
        answers = "1 line" if count == 1 else f"{count} lines"
        people.say(f"{mapping}: {answers} as before the answers" if count else f"{mapping}: no answer to forget")
    elif mapping is not None:
        people.say(f"{mapping} got answers too and is not there; where it is now: --mapping FILE")
    forgotten, count = with_answers_forgotten(session)
    if count or named:
        facts = {key: text for key, text in forgotten.facts.items() if key != ANSWERED_MAPPING_FACT}
        write_session(replace(forgotten, facts=facts), path, overwrite=True)
        _renew_pictures(path, people)
    answers = "1 answer" if count == 1 else f"{count} answers"
    people.say(f"{path}: {answers} forgotten" if count else f"{path}: no answer to forget")
    return OK


def _renew_pictures(path: Path, people: People) -> None:
    """Draw the pictures of a recording again where there are any."""
    from cdcore.errors import CollisionCoreError
    from replay.advice.assumptions import examine_assumptions
    from replay.errors import ReplayError
    from sessions import read_session

    folder = path.with_name(path.stem + FOLDER_END)
    if not folder.is_dir():
        return
    try:
        _write_pictures(examine_assumptions(read_session(path), rows=()), folder, people)
    except (ReplayError, CollisionCoreError) as error:
        people.say(f"note: the pictures in {folder} show the recording before the answers ({error})")


def _write_pictures(examined: "AssumptionReview", folder: Path, people: People) -> list[Path]:
    """The pictures of three moments, and the recording for Rerun where that can be written."""
    from replay.show.rerun_log.scene_look import write_scene_recording
    from replay.show.scene_look import moments_to_show, write_scene_pictures

    outcome, scene, assembly = examined.outcome, examined.session.scene, examined.sampled
    moments = moments_to_show(assembly, outcome.closest_frame, outcome.closest_pair)
    paths = write_scene_pictures(assembly, scene, moments, folder)
    try:
        write_scene_recording(assembly, scene, moments, folder / PICTURE)
        paths.append(folder / PICTURE)
    except (OSError, ImportError) as error:
        people.say(f"note: no {PICTURE} for Rerun ({error})")
    return paths


def _check_answers(questions: Sequence["Question"], given: Answers) -> None:
    for number, alternative in given.items():
        if number >= len(questions):
            number_text = "there is no question" if not questions else f"there are {len(questions)} questions"
            raise click.BadParameter(
                f"{number + 1}{ascii_lowercase[alternative]}: {number_text}", param_hint="--answer"
            )
        if alternative >= len(questions[number].alternatives):
            allowed = ", ".join(ascii_lowercase[: len(questions[number].alternatives)])
            raise click.BadParameter(f"question {number + 1} has the answers {allowed}", param_hint="--answer")


def _as_json(examined: "AssumptionReview", pictures: Sequence[Path], given: Answers) -> dict[str, Any]:
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
        for number, question in enumerate(examined.questions)
    ]
    frames = {"frames": len(examined.frames), "of": len(examined.assembly.motion)}
    return {"pictures": [str(path) for path in pictures], "asked": frames, "questions": questions}


def _screen(examined: "AssumptionReview", pictures: Sequence[Path], path: Path) -> "RenderableType":
    """The pictures, what the recording shows as it is, and each question with its alternatives."""
    from rich.text import Text

    from replay.advice.scene_outcome import outcome_text
    from replay.cli.terminal import Paragraph, terminal

    del path
    names = ", ".join([str(pictures[0]), *(picture.name for picture in pictures[1:])])
    contents: list[RenderableType] = [Paragraph("", f"Is this your scene?  Pictures: {names}")]
    sampled = ""
    if examined.is_thinned:
        sampled = f" ({len(examined.frames):,} of {len(examined.assembly.motion):,} frames)"
    contents.append(Paragraph("", f"The recording as it is now: {outcome_text(examined.outcome)}{sampled}."))
    if not examined.questions:
        contents.append(Paragraph("", "Nothing that the import guessed changes its contacts."))
    for number, question in enumerate(examined.questions, start=1):
        contents.append(Text())
        row = question.assumption
        why = f": {row.reason}" if row.reason else ""
        label = f" {number} of {len(examined.questions)}  "
        contents.append(Paragraph(label, f"{_capital(row.title)}; {row.origin}{why}."))
        for letter, alternative in zip(ascii_lowercase, question.alternatives, strict=False):
            marks = [" (as it is now)"] if alternative.is_current else []
            marks += ["  more plausible"] if alternative.value == question.plausible else []
            description = f"{alternative.description}: {alternative.words}{''.join(marks)}"
            contents.append(Paragraph(f"         {letter}  ", description))
    return terminal(*contents)


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _answers_of_a_person(questions: Sequence["Question"], given: Answers) -> dict[int, int]:
    """Reads the answers of a person on the terminal; Enter leaves a question open."""
    chosen = {}
    for number, question in enumerate(questions):
        if number in given:
            continue
        choices = ascii_lowercase[: len(question.alternatives)]
        while True:
            prompt = f" {number + 1} of {len(questions)}  Which one? [{'/'.join(choices)}/?; Enter: {LEAVE}]"
            reply = click.prompt(prompt, default="", show_default=False, prompt_suffix=" ").strip().lower()
            if not reply:
                break
            if len(reply) == 1 and reply in choices:
                chosen[number] = choices.index(reply)
                break
            click.echo("      Choose the letter of the line that shows your scene: see the pictures.")
    return chosen


def _keep(session: "Session", path: Path, questions: Sequence["Question"], chosen: Answers, people: People) -> None:
    """Write the answers into the recording, and say how to undo them and how to give them to the next import."""
    from sessions import write_session
    from sessions.scene_files.answers import OPTIONS, with_answer

    if not chosen:
        return
    changed = session
    for number, alternative in chosen.items():
        value = questions[number].alternatives[alternative].value
        changed = with_answer(changed, questions[number].assumption, value)
        option = OPTIONS.get(questions[number].assumption.subject, "")
        if option.startswith("--"):
            people.say(f"To answer it when you import again: {option} {value!r}".replace("'", '"'))
    write_session(changed, path, overwrite=True)
    if any(not questions[number].alternatives[alternative].is_current for number, alternative in chosen.items()):
        _renew_pictures(path, people)
    people.say(f"Written to {path}. To undo: replay doctor {path} --forget-answers")


def _kept_in_mapping(
    session: "Session", path: Path, mapping: Path, questions: Sequence["Question"], chosen: Answers, people: People
) -> "Session":
    """The recording with the mapping that got its answers, for the next import, among its facts."""
    from sessions.importers.mapping_answers import ANSWERED_MAPPING_FACT, write_answers

    answers = [
        (questions[number].assumption, questions[number].alternatives[alternative].value)
        for number, alternative in chosen.items()
    ]
    keys = write_answers(mapping, answers)
    people.say(f"Written to {mapping}: {', '.join(keys)}")
    named = Path(os.path.relpath(mapping, path.parent)).as_posix()
    return replace(session, facts={**session.facts, ANSWERED_MAPPING_FACT: named})


def _decides(question: "Question", number: int, path: Path) -> str:
    """The option that decides a question."""
    from sessions.scene_files.answers import OPTIONS

    answers = [f"{number + 1}{letter}" for letter in ascii_lowercase[: len(question.alternatives)]]
    option = OPTIONS.get(question.assumption.subject, "the mapping")
    *first, last = answers
    return f"To decide: replay doctor {path} --answer {', '.join(first)} or {last}; or {option} when you import it"
