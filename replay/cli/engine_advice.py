"""``replay tradeoff --engine``: the knobs of an engine in its own words, what each misses, and what to change."""

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
        "engine": advice.engine.name, "source": advice.engine.source, "rows": list(advice.rows),
        "advice": list(advice.sentences),
    }  # fmt: skip
    behind = sources_of([advice.result]) if people.verbose else {}
    words = [line(sentence) for sentence in advice.sentences]
    answer_cited(as_json, plain, lambda: terminal(knob_table(advice), Text(), *words), behind)
    code = close_run(advice.result, people)
    if advice.result.out is not None:
        people.say(*where_to_look(advice.result, picture=not no_picture))
    return code


def knob_table(advice: "Advice") -> "Table":
    """A row a choice: the setting that ``run`` takes, below it what it is in the engine."""
    from replay.outputs.tables import IN_RED, INVENTED, PARTLY, STRONG, Marked, table
    from replay.pipeline.gates import figure
    from replay.tradeoffs.engine_knobs import knob_words

    rows = []
    for row in advice.rows:
        words = f"{row['number']}  {knob_words(row['knobs'])}"
        false = "" if row["false"] is None else figure(100 * row["false"])
        what = Marked(row["setting"], STRONG, words)
        p99 = "" if row["p99_ms"] is None else f"{row['p99_ms']:.3f}"
        rows.append(
            (
                what,
                row["missed"],
                row["in_part"],
                Marked(false, INVENTED if row["false"] else ""),
                f"{row['ms']:.3f}",
                p99,
            )
        )
    about = advice.result.summary["session"]
    contacts = len(advice.result.episodes[advice.result.oracle])
    title = f"{advice.engine.name}: {contacts} contacts in {about['duration']:.0f} s, beside {advice.result.oracle}"
    notes = (
        "missed, in part: contacts; false: of the pair-frames reported; mean: ms a frame; p99: ms of a sample, live, "
        "of this program, p99 "
        "empty where a whole recording is asked at once.",
        f"Each row is checked by: replay run SESSION --detectors SETTING. Words: {advice.engine.source}.",
        *advice.engine.notes,
    )
    head = ("setting, and what it is there", "missed", "part", "false %", "mean ms", "p99 ms")
    return table(title, head, rows, whole=(), marks={"missed": IN_RED, "part": PARTLY}, notes=notes)
