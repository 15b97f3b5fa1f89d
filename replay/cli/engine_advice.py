"""``replay tradeoff --engine``: the settings of an engine in its own words, what each gets wrong, and which to take."""

from importlib.util import find_spec
from pathlib import Path
from typing import Any

from replay.cli.console import People, TerminalProgress


def advise_engine(session: Path, engine: str, people: People, *, as_json: bool, **asked: Any) -> int:
    """Print and write what the settings of an engine came to; the exit code of the run behind it."""
    from rich.text import Text

    from replay.api.advisor import advise
    from replay.cli.run_report import answer_cited, close_run, sources_of, where_to_look
    from replay.cli.terminal import line, terminal
    from replay.outputs.tradeoff_table import engine_table
    from replay.prepare.convex_pieces import cache_folder

    if find_spec("coacd") and not any(cache_folder().glob("pieces-*")):
        people.say("cutting meshes into convex pieces, once per machine: about ten seconds each ...")
    advice = advise(session, engine=engine, progress=TerminalProgress(people), **asked)
    plain = {
        "engine": advice.engine.name, "version": advice.engine.version, "pages": dict(advice.engine.pages),
        "rows": list(advice.rows), "advice": list(advice.sentences),
    }  # fmt: skip
    table = engine_table(advice.engine, advice.rows, advice.result, settings=people.verbose)
    sentences = map(line, advice.sentences)
    answer_cited(as_json, plain, lambda: terminal(table, Text(), *sentences), sources_of(advice.result, people))
    code = close_run(advice.result, people)
    if advice.result.out is not None:
        people.say(*where_to_look(advice.result))
    return code
