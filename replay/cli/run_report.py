"""What ``run`` and ``demo`` say when they are done: tables or JSON on stdout, what to do next on stderr."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from math import isnan
from typing import TYPE_CHECKING, Any, TypeAlias

from replay.cli.console import DATA_LOSS, OK, People, answer
from replay.comparison.clusters import by_depth
from replay.pipeline.run_result import RunResult
from replay.prepare.repair import DAMAGE

if TYPE_CHECKING:
    from rich.console import RenderableType

Sources: TypeAlias = Mapping[str, tuple[str, ...]]
"""``detector NAME`` or ``effect KIND`` -> citations."""


def report_run(result: RunResult, people: People, broken: Sequence[str] = (), *, as_json: bool = False) -> int:
    """Print a run, for who wants more with the sources behind it; the exit code: 3 when frames could not be used.

    ``broken`` are the gates that failed; they stand in the JSON.
    """
    from replay.cli.run_tables import run_tables

    behind = sources_of([result]) if people.verbose else {}

    def plain() -> dict[str, Any]:
        return run_json(result) | {"broken": [*broken]}

    answer_cited(as_json, plain, lambda: run_tables(result, everything=people.verbose), behind)
    return close_run(result, people)


def sources_of(results: Sequence[RunResult]) -> Sources:
    """The sources behind runs: of every detector and effect that ran, and of no others."""
    from replay.pipeline.citations import sources_behind

    ran = (one for result in results for one in result.summary["detectors"].values())
    return sources_behind((one["name"] for one in ran), (one for result in results for one in result.effects.items()))


def answer_cited(
    as_json: bool, plain: Mapping[str, Any] | Callable[[], Mapping[str, Any]],
    shown: "Callable[[], RenderableType]", behind: Sources, sentences: Sequence[str] = (),
) -> None:  # fmt: skip
    """``answer``; where it is text, sentences below it; then the sources ``behind`` it, none if not asked for."""
    from replay.pipeline.citations import citations

    def told() -> dict[str, Any]:
        return {**(plain() if callable(plain) else plain), **({"sources": behind} if behind else {})}

    answer(as_json, told, shown)
    below = [*sentences, *(["", *citations(behind).splitlines()] if behind else [])]
    if below and not as_json:
        answer(False, None, lambda: below)


def close_run(result: RunResult, people: People) -> int:
    """Say what people should know about a run, and return its exit code: 3 where poses or frames had to be left out."""
    for label, detector in result.summary["detectors"].items():
        settings = ", ".join(f"{name}={value}" for name, value in detector["settings"].items())
        people.detail(f"{label}: {detector['name']}[{settings}], verdicts {detector['digest'] or 'not reproducible'}")
    notes = [*result.assembly.notes, *repair_sentences(result.summary)]
    lists = {
        "declared, not computed by this version": result.summary["plan"]["not_built"],
        "no mesh, so not looked at": result.assembly.left_out,
    }
    notes += [f"{why}: {', '.join(names)}" for why, names in lists.items() if names]
    people.say(*(f"note: {note}" for note in notes))
    return DATA_LOSS if lost_frames(result.summary) or lost_poses(result.summary) else OK


def where_to_look(result: RunResult, *, picture: bool = True) -> list[str]:
    """What was written, and the commands that show it: the page, the picture, and the longest cut that was missed."""
    if result.out is None:
        return ["nothing was written; with --out DIR there are a report, tables and a picture of every miss"]
    lines = [f"wrote {result.out}; read {result.out / 'report.html'}"]
    if not picture:
        return lines
    lines.append(f"open the picture:      replay view {result.out}")
    worst = [(label, by_depth(found)[0]) for label, found in result.misses.items() if found]
    if worst:
        label, longest = max(worst, key=lambda one: one[1].cut_length)
        where = "at the longest cut: " if longest.touch is None else "between two frames: "
        by = f" --by {label}" if len(result.misses) > 1 else ""
        lines.append(f"or {where}replay view {result.out} --miss {longest.number}{by}")
    return lines


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
    misses = {
        label: [asdict(miss) | {"faces": None if miss.faces is None else miss.faces.tolist()} for miss in found]
        for label, found in result.misses.items()
    }
    false = {
        label: [asdict(one) | {"gap": None if isnan(one.gap) else one.gap} for one in found]
        for label, found in result.false.items()
    }
    return {**result.summary, "misses": misses, "false": false, "out": None if result.out is None else str(result.out)}
