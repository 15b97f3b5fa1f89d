"""A run as tables for a terminal: who missed what, when, and what it cost."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final

import numpy as np
from rich import box
from rich.console import Group, RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from replay.audit.headline import headline, invented, price
from replay.audit.misses import NEVER_FOUND
from replay.audit.outcome import Miss, Outcome
from replay.base.constants import CAVEAT
from replay.effect_summary import happened_words
from replay.run_result import RunResult

MISS_ROWS: Final = 20
"""Misses listed in a terminal; the tables of the run folder hold them all."""

PAIR_ROWS: Final = 20

RED: Final = "#ff2d55"
"""The red of missed contacts, here as in the picture, and of nothing else."""

BLUE: Final = "#5aa9e6"
YELLOW: Final = "#ffcc00"

WITHIN_TOLERANCE: Final = "within tolerance"

PAIR_COLUMNS: Final = {
    "contacts": "",
    "missed": f"bold {RED}",
    "in part": RED,
    "frames found": BLUE,
    "frames missed": RED,
    "frames invented": YELLOW,
    WITHIN_TOLERANCE: "dim",
}
"""Columns of the table of pairs and the colour of a count that is not zero; the last is shown if it has any."""


def run_tables(result: RunResult) -> Group:
    """Everything a terminal shows of a run."""
    parts: list[RenderableType] = [Text(), *headlines(result)] if result.comparisons else []
    for label in result.comparisons:
        parts += [Text(), pair_table(result, label)]
        if result.misses[label]:
            parts += [Text(), miss_table(result, label)]
    if not result.comparisons and result.detections:
        parts += [Text(), contact_table(result)]
    if result.detections:
        parts += [Text(), cost_table(result)]
    else:
        parts += [Text(), Text(f" {no_detection(result)}")]
    if result.effects:
        parts += [Text(), effect_table(result)]
        if not result.detections:
            parts += [Text(), *(Text(f" {line}") for line in happened_words(result.effects, MISS_ROWS))]
    parts += [Text(), Padding(Text(CAVEAT, style="dim"), (0, 1))]
    if result.assembly.proxies:
        parts.append(Text(f" Proxy meshes stand in for: {', '.join(result.assembly.proxies)}.", style="dim"))
    return Group(*parts)


def headlines(result: RunResult) -> list[RenderableType]:
    """The answer before any table: what each detector missed, and what that took."""
    answers = [headline_text(result, label) for label in result.comparisons]
    beside = [
        *(Text(line, style=YELLOW) for line in invented(result)),
        *(Text(line, style="dim") for line in price(result)),
    ]
    return [*answers, *(Padding(line, (0, 1)) for line in beside)]


def no_detection(result: RunResult) -> str:
    """Why there is no contact to tell of."""
    effects = ", ".join(dict.fromkeys(effect.kind for effect in result.session.scene.effects or ())) or "nothing"
    return f"No contact was looked for: the scene calls for {effects}. Ask with --detectors."


def headline_text(result: RunResult, label: str) -> Text:
    """What was missed, in one line: red where a contact was, green where none was."""
    text = Text(" ").append(headline(result, label), style=f"bold {RED}" if result.misses[label] else "bold green")
    return text.append(f"   oracle: {result.oracle}", style="dim")


def pair_table(result: RunResult, label: str) -> Table:
    """One row per pair that touched or was said to, worst first."""
    outcome = result.comparisons[label].outcome
    table = _table(f"contacts, and what {label} made of them", "pair")
    rows = sorted(_pair_rows(result, label, outcome), key=lambda row: (-row[2], -row[5], -row[1], row[0]))
    columns = PAIR_COLUMNS if any(row[-1] for row in rows) else without_tolerance(PAIR_COLUMNS)
    for name in columns:
        table.add_column(name, justify="right")
    for name, *counts in rows[:PAIR_ROWS]:
        styled = zip(counts, columns.values(), strict=False)
        table.add_row(name, *(Text(_count(count), style=style if count else "dim") for count, style in styled))
    if len(rows) > PAIR_ROWS:
        table.add_row(f"… and {len(rows) - PAIR_ROWS} more", *[""] * len(columns))
    return table


def without_tolerance(columns: Mapping[str, str]) -> dict[str, str]:
    """The columns of a table in which nothing is within tolerance: all but the last."""
    return {name: style for name, style in columns.items() if name != WITHIN_TOLERANCE}


def _pair_rows(
    result: RunResult, label: str, outcome: np.ndarray[Any, np.dtype[np.uint8]]
) -> Iterator[tuple[str, int, int, int, int, int, int, int]]:
    contacts = [episode.pair for episode in result.episodes[result.oracle]]
    misses = result.misses[label]
    for pair in range(outcome.shape[1]):
        counts = np.bincount(outcome[:, pair], minlength=len(Outcome)).tolist()
        touched = contacts.count(pair)
        whole = len({miss.episode for miss in misses if miss.pair == pair and miss.kind == NEVER_FOUND})
        part = sum(miss.pair == pair and miss.kind != NEVER_FOUND for miss in misses)
        found, missed, invented = (counts[what] for what in (Outcome.BOTH, Outcome.MISSED, Outcome.INVENTED))
        excused = counts[Outcome.WITHIN_TOLERANCE]
        if touched or invented or excused:
            held = " (held)" if result.assembly.held[pair] else ""
            yield result.assembly.pair_name(pair) + held, touched, whole, part, found, missed, invented, excused


def miss_table(result: RunResult, label: str) -> Table:
    """The numbered misses: never found ones first, then in order of time."""
    table = _table(f"missed by {label}", "#", justify="right", style=f"bold {RED}")
    for name, justify in (("at", "right"), ("pair", "left"), ("for", "right"), ("what", "left")):
        table.add_column(name, justify=justify, no_wrap=name == "pair")  # type: ignore[arg-type]
    table.add_column("cut", justify="right")
    table.add_column("face pairs", justify="right")
    misses = sorted(result.misses[label], key=lambda miss: (miss.kind != NEVER_FOUND, miss.number))
    for miss in misses[:MISS_ROWS]:
        frames = miss.last - miss.first + 1
        table.add_row(
            str(miss.number),
            f"{miss.seconds:.3f} s",
            f"{miss.body_a} - {miss.body_b}",
            f"{frames} frame{'s' if frames > 1 else ''}",
            Text(miss.kind, style="bold" if miss.kind == NEVER_FOUND else "dim"),
            _depth(miss),
            _count(miss.face_pairs),
        )
    if len(misses) > MISS_ROWS:
        table.add_row("", "", f"… and {len(misses) - MISS_ROWS} more in misses.parquet", "", "", "", "")
    return table


def _depth(miss: Miss) -> str:
    """How long the cut is, or that no frame shows one."""
    if miss.touch is not None:
        return "between frames"
    return f"{1000 * miss.cut_length:.1f} mm" if miss.cut_length else ""


def contact_table(result: RunResult) -> Table:
    """Contacts per pair and detector, where nobody is audited."""
    table = _table("contacts", "pair")
    for label in result.detections:
        table.add_column(label, justify="right", style=BLUE)
    touched: dict[int, dict[str, int]] = {}
    for label, found in result.episodes.items():
        for episode in found:
            row = touched.setdefault(episode.pair, {})
            row[label] = row.get(label, 0) + 1
    for pair in sorted(touched):
        table.add_row(
            result.assembly.pair_name(pair), *(_count(touched[pair].get(label, 0)) for label in result.detections)
        )
    if not touched:
        table.add_row("none", *[""] * len(result.detections))
    return table


def cost_table(result: RunResult) -> Table:
    """What each detector took: the whole, per frame, and the most of any single frame where that is known."""
    table = _table("time", "detector")
    for name in ("role", "detect", "per frame", "worst frame", "longest stage"):
        table.add_column(name, justify="left" if name in ("role", "longest stage") else "right")
    for label, detector in result.summary["detectors"].items():
        table.add_row(label, *_cost_row(detector, label == result.oracle))
    return table


def effect_table(result: RunResult) -> Table:
    """What each effect found, its share of the run's time, and how much of the session its trigger skipped."""
    table = _table("effects", "effect")
    for name in ("found", "time", "of the run", "skipped"):
        table.add_column(name, justify="left" if name == "found" else "right")
    for kind, told in result.summary["effects"].items():
        found = ", ".join(f"{count} {name}" for name, count in told["events"].items()) or "nothing"
        skipped = 1.0 - told["frames_run"] / max(1, told["frames"])
        table.add_row(kind, found, _duration(told["seconds"]), f"{100 * told['share']:.1f} %", f"{100 * skipped:.0f} %")
    return table


def _cost_row(detector: Mapping[str, Any], is_oracle: bool) -> list[str]:
    seconds = detector["seconds"]
    per_frame = seconds.get("per_frame")
    stages = seconds["stages"]
    total = sum(stages.values())
    longest = max(stages, key=stages.__getitem__) if stages else ""
    share = f"{longest} {100 * stages[longest] / total:.0f} %" if total > 0 else longest
    return [
        "oracle" if is_oracle else "online" if detector["online"] else "offline",
        _duration(seconds["detect"]),
        _duration(seconds["per_frame_mean"]),
        _duration(per_frame["max"]) if per_frame else "",
        share,
    ]


def _duration(seconds: float) -> str:
    if seconds >= 1.0:
        return f"{seconds:.2f} s"
    if seconds >= 1e-3:
        return f"{1e3 * seconds:.1f} ms"
    return f"{1e6 * seconds:.1f} µs"


def _count(count: int) -> str:
    return f"{count:,}" if count else "·"


def _table(title: str, first: str, **options: Any) -> Table:
    table = Table(
        title=Text(f" {title}", style="dim italic"),
        title_justify="left",
        box=box.SIMPLE_HEAD,
        header_style="dim",
        show_edge=False,
    )
    table.add_column(first, **{"no_wrap": True, **options})
    return table
