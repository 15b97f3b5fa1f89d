"""``replay tradeoff --engine``: settings of an engine in its words, and which to take."""

from pathlib import Path
from shlex import quote
from typing import Any

from replay.cli.console import People, TerminalProgress
from replay.document.placeholders import RECORDING


def advise_engine(session: Path, engine: str, people: People, *, as_json: bool, **options: Any) -> int:
    """Print and write what the settings of an engine came to; the exit code of the run behind it."""
    from rich.text import Text

    from replay.cli.run_report import answer_cited, close_run, commands_to_open, sources_of
    from replay.cli.terminal import line, stacked
    from replay.cutting.piece_store import PIECES_ARE_KEPT, pieces_are_stored
    from replay.document.headline import open_questions
    from replay.running.advisor import advise
    from replay.show.tradeoff_table import engine_table

    try:
        advice = advise(session, engine=engine, progress=TerminalProgress(people), **options)
    except KeyboardInterrupt:
        if pieces_are_stored():
            people.say(PIECES_ARE_KEPT)
        raise
    questions = [text.replace(RECORDING, quote(str(session))) for text in open_questions(advice.result.document)]
    json_value = {
        "engine": advice.engine.name,
        "version": advice.engine.version,
        "pages": dict(advice.engine.pages),
        "rows": list(advice.rows),
        "advice": list(advice.sentences),
        "time_limit": advice.time_limit,
        "not_tried": list(advice.not_tried),
        "open_questions": questions,
    }
    table = engine_table(advice.engine, advice.rows, advice.result, settings=people.verbose)
    sentences = map(line, [*advice.sentences, *questions])
    answer_cited(as_json, json_value, lambda: stacked(table, Text(), *sentences), sources_of(advice.result, people))
    code = close_run(advice.result, people)
    if advice.result.out is not None:
        people.say(*commands_to_open(advice.result))
    return code
