"""What ``run`` and ``demo`` say when they are done: the answer or JSON on stdout, notes on stderr."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from replay.cli.console import DATA_LOSS, OK, People, answer
from replay.outputs.contact_tables import false_rows, miss_rows
from replay.pipeline.run_result import RunResult
from replay.prepare.repair import DAMAGE

if TYPE_CHECKING:
    from rich.console import RenderableType

Sources: TypeAlias = Mapping[str, tuple[str, ...]]
"""``detector NAME`` or ``effect KIND`` -> citations."""


def report_run(
    result: RunResult, people: People, broken: Sequence[str] = (), *, as_json: bool = False, picture: bool = True,
    recording: Path | None = None,
) -> int:  # fmt: skip
    """Print a run, the tables and sources too for who wants more; the exit code: 3 when frames could not be used.

    ``broken`` are the gates that failed; they stand in the JSON. ``recording`` is the file that was replayed.
    """
    from replay.cli.run_tables import run_screen, run_tables
    from replay.pipeline.answer import SESSION

    behind = sources_of([result]) if people.verbose else {}
    where = where_to_look(result, picture=picture)

    def plain() -> dict[str, Any]:
        return run_json(result) | {"broken": [*broken]}

    code = close_run(result, people)
    if people.verbose and not as_json:
        answer_cited(False, None, lambda: run_tables(result), behind)
    named = SESSION if recording is None else str(recording)
    cited = behind if as_json else {}
    answer_cited(as_json, plain, lambda: run_screen(result, where, recording=named), cited)
    if as_json:
        people.say("", *where)
    return code


def sources_of(results: Sequence[RunResult]) -> Sources:
    """The sources behind runs: of every detector and effect that ran, and of no others."""
    from replay.pipeline.citations import sources_behind

    ran = (one for result in results for one in result.summary["detectors"].values())
    return sources_behind((one["name"] for one in ran), (one for result in results for one in result.effects.items()))


def answer_cited(
    as_json: bool, plain: Mapping[str, Any] | Callable[[], Mapping[str, Any]] | None,
    shown: "Callable[[], RenderableType]", behind: Sources, sentences: Sequence[str] = (),
) -> None:  # fmt: skip
    """``answer``; where it is text, sentences below it; then the sources ``behind`` it, none if not asked for."""
    from replay.pipeline.citations import citations

    def told() -> dict[str, Any]:
        return {**((plain() if callable(plain) else plain) or {}), **({"sources": behind} if behind else {})}

    answer(as_json, told, shown)
    below = [*sentences, *(["", *citations(behind).splitlines()] if behind else [])]
    if below and not as_json:
        answer(False, None, lambda: below)


def close_run(result: RunResult, people: People) -> int:
    """Say what people should know about a run, and return its exit code: 3 where poses or frames had to be left out."""
    for label, detector in result.summary["detectors"].items():
        settings = ", ".join(f"{name}={value}" for name, value in detector["settings"].items())
        people.detail(f"{label}: {detector['name']}[{settings}], verdicts {detector['digest']}")
    notes = [*result.assembly.notes, *repair_sentences(result.summary)]
    if result.assembly.left_out:
        notes.append(f"no mesh, so not looked at: {', '.join(result.assembly.left_out)}")
    people.say(*(f"note: {note}" for note in notes))
    return DATA_LOSS if lost_frames(result.summary) or lost_poses(result.summary) else OK


def where_to_look(result: RunResult, *, picture: bool = True) -> list[str]:
    """The commands that show a run: the picture at the moment of its answer, and the page."""
    if result.out is None:
        return ["Nothing was written; with --out DIR there are a report, tables and a picture of every moment."]
    lines = []
    if picture:
        first = result.answers[0] if result.answers else None
        moment = "" if first is None or first.moment is None else f" {first.moment.option}"
        by = f" --by {first.label}" if first is not None and moment and len(result.comparisons) > 1 else ""
        lines.append(f"See it   replay view {result.out}{moment}{by}")
    return [*lines, f"Read it  {result.out / 'report.html'}   (-v prints every table here)"]


def lost_frames(summary: Mapping[str, Any]) -> int:
    """Frames of the recording that were left out."""
    return sum(summary["session"]["dropped_frames"].values())


def lost_poses(summary: Mapping[str, Any]) -> int:
    """Samples that claimed to be poses and were none."""
    return sum(one["dropped"] for one in summary.get("flagged", ()) if one["kind"] in DAMAGE)


def repair_sentences(summary: Mapping[str, Any]) -> list[str]:
    """A sentence per kind and body whose poses were in doubt; losses that the tracker flagged itself go without."""
    count: Counter[tuple[str, str, str]] = Counter()
    for one in summary.get("flagged", ()):
        count[one["kind"], one["body"], one["action"]] += one["samples"]
    return [
        f"{kind}{' of ' + body if body else ''}: {samples} samples, {action}"
        for (kind, body, action), samples in count.items()
        if kind not in ("tracking-lost", "gap")
    ]


def run_json(result: RunResult) -> dict[str, Any]:
    """The summary, the misses, the false contacts, and where the rest lies; null: not measured."""
    tables = {"misses": miss_rows(result), "false": false_rows(result)}
    rows = {
        name: {label: table.where(detector=label).plain() for label in result.comparisons}
        for name, table in tables.items()
    }
    return {**result.summary, **rows, "out": None if result.out is None else str(result.out)}
