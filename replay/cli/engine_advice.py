"""``replay tradeoff --engine``: the settings of an engine in its own words, what each gets wrong, and which to take."""

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from replay.cli.console import People, TerminalProgress

if TYPE_CHECKING:
    from replay.api.advisor import Advice
    from replay.outputs.tables import Table


def advise_engine(session: Path, engine: str, people: People, *, no_picture: bool, as_json: bool, **asked: Any) -> int:
    """Print and write what the settings of an engine came to; the exit code of the run behind it."""
    from rich.text import Text

    from replay.api.advisor import advise
    from replay.cli.run_report import answer_cited, close_run, sources_of, where_to_look
    from replay.cli.terminal import line, terminal
    from replay.prepare.convex_pieces import cache_folder

    if find_spec("coacd") and not any(cache_folder().glob("pieces-*")):
        people.say("cutting meshes into convex pieces, once per machine: about ten seconds each ...")
    advice = advise(session, engine=engine, picture=not no_picture, progress=TerminalProgress(people), **asked)
    plain = {
        "engine": advice.engine.name, "version": advice.engine.version, "pages": dict(advice.engine.pages),
        "rows": list(advice.rows), "advice": list(advice.sentences),
    }  # fmt: skip
    behind = sources_of([advice.result]) if people.verbose else {}
    words = [line(sentence) for sentence in advice.sentences]
    answer_cited(
        as_json, plain, lambda: terminal(engine_table(advice, everything=people.verbose), Text(), *words), behind
    )
    code = close_run(advice.result, people)
    if advice.result.out is not None:
        people.say(*where_to_look(advice.result, picture=not no_picture))
    return code


def engine_table(advice: "Advice", *, everything: bool = False) -> "Table":
    """A row a choice: what is set in the engine and what comes of it; the settings that ``run`` takes on request."""
    from replay.outputs.tables import Column, Table
    from replay.outputs.tradeoff_table import FALSE, LATE, MISSED, P99, WRONG
    from replay.tradeoffs.engine_knobs import knob_words

    engine, result = advice.engine, advice.result
    contacts, seconds = len(result.episodes[result.oracle]), result.summary["session"]["duration"]
    title = f"{engine.name} {engine.version}: {contacts} contacts in {seconds:.0f} s, beside {result.oracle}"
    notes = (
        "false %: of the contact time reported. wrong: missed, late or cut short, and false contacts; a range is over "
        "16 sampling offsets. Times of this tool on this machine, not of your engine.",
        *engine.notes,
        "replay guide engines: the page behind every row. -v: the setting of every row, for replay run --detectors.",
    )
    columns = [
        Column("setting", of=lambda row: f"{row['number']}  {knob_words(row['knobs'])}"), MISSED, LATE, FALSE, WRONG,
        Column("mean ms", float, of="ms", show=".3f"), P99,
    ]  # fmt: skip
    if everything:
        columns.append(Column("settings", of="setting", whole=True))
    return Table.of(columns, advice.rows, title, notes)
