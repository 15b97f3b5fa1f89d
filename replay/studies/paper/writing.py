"""The tables on disk: JSON, pictures, one page that needs no other file, a recording for Rerun, the calibration."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from replay.outputs.paper_table import Cell, PaperTable
from replay.outputs.report.markup import element, listed, page_html, page_section, picture
from replay.outputs.rerun_log.paper_recording import record
from replay.studies.paper.calibration import put, write_calibration
from replay.studies.paper.experiment import PaperResult
from replay.studies.paper.feature_samples import ALL, SEARCHERS
from replay.studies.paper.pictures import pictures_of
from replay.studies.paper.printed import PRINTED

TITLE: Final = "The paper's tables, regenerated"


def write_paper(result: PaperResult, out: Path) -> list[Path]:
    """Write all files below ``out``; returns their paths."""
    out.mkdir(parents=True, exist_ok=True)
    written = [out / "calibration.json", out / "paper.json"]
    write_calibration(result.calibration, written[0])
    put(written[1], json.dumps(as_json(result), indent=1, allow_nan=False) + "\n")
    drawn = pictures_of(result.tables)
    for name, png in drawn.values():
        put(out / name, png)
    put(out / "paper.html", page(result, drawn))
    record(result, drawn, out / "paper.rrd")
    return [*written, *(out / name for name, _ in drawn.values()), out / "paper.html", out / "paper.rrd"]


def as_json(result: PaperResult) -> dict[str, Any]:
    """Everything as plain data: verdict, experiment, fixtures, tables."""
    return {
        "version": 2,
        "verdict": verdict_of(result.tables),
        "experiment": result.experiment,
        "hard_fixtures": result.hard,
        "fixtures": [one.record for one in result.fixtures],
        "tables": [vars(one) for one in result.tables],
    }


def page(result: PaperResult, drawn: Mapping[str, tuple[str, bytes]]) -> str:
    """The page as text: what the tables say, then every table below its picture."""
    parts = [page_section("What the tables say", listed(verdict_of(result.tables)))]
    for one in result.tables:
        shape = [picture(drawn[one.key][1], one.title)] if one.key in drawn else []
        cells = replace(one.plain, title=one.note, notes=())
        parts.append(page_section(f"{one.key}: {one.title}", *shape, cells))
    return page_html(TITLE, [element("p", _preamble(result)), element("h1", TITLE)], parts)


def _preamble(result: PaperResult) -> str:
    """How much was run, on which machine the times were taken, and what printed values are."""
    size, machine = result.experiment, result.calibration.machine
    where = machine.get("processor")
    return (
        f"{len(result.fixtures)} poses of Table I ({result.hard} in which FCL rounds wrongly), {size['near']:,} random "
        f"poses of each family, {size['sessions']} sessions, seed {size['seed']}; times of {where}, "
        f"{machine.get('cores')} cores. What the paper printed stands only below: {PRINTED}."
    )


def verdict_of(tables: Sequence[PaperTable]) -> list[str]:
    """Sentences on completeness, caps, frames, the colony and samples of faces."""
    by_key = {one.key: one for one in tables}
    families = list(dict.fromkeys(str(cell) for cell in by_key["F7e"].column("family")))
    return [
        _completion(by_key["T1a"]),
        _caps(by_key["T1c"]),
        _frames(by_key["T1d"]),
        *(_colony(by_key["F7e"], family) for family in families),
        *(_ablation(by_key["ablation"], family) for family in families),
        *(_samples(by_key["F8 coverage"], by_key["F8 search"], family) for family in families),
    ]


def _percent(cell: Cell) -> str:
    return "-" if cell is None or isinstance(cell, str) else f"{100 * cell:.1f} %"


def _completion(table: PaperTable) -> str:
    cells = zip(*(table.column(h) for h in ("algorithm", "poses", "poses with every pair")), strict=True)
    whole = [str(name) for name, poses, every in cells if poses == every]
    least = min(float(cell) for cell in table.column("precision") if isinstance(cell, float | int))
    return (
        f"T1a: every face pair of all {table.rows[0][1]} poses is found by {', '.join(whole) or 'none'}; "
        f"the least precision of all rows is {least:g}."
    )


def _caps(table: PaperTable) -> str:
    parts = []
    for cap in dict.fromkeys(table.column("contacts")):
        recalls = [float(cell) for cell in table.where(contacts=cap).column("face recall") if isinstance(cell, float)]
        ends = dict.fromkeys((_percent(min(recalls)), _percent(max(recalls))))
        parts.append(f"{' to '.join(ends)} after {cap}")
    return f"T1c: an engine that stops after some contacts lists so much of the faces that meet: {', '.join(parts)}."


def _frames(table: PaperTable) -> str:
    heads = ("looks a second", "missed, mean", "missed seconds, share")
    parts = [
        f"{missed:.1f} ({_percent(share)} of the seconds) at {rate:g} looks a second"
        for rate, missed, share in zip(*(table.column(head) for head in heads), strict=True)
    ]
    return f"T1d: of {table.rows[0][1]} contacts these are missed, mean of all phases: {', '.join(parts)}."


def _colony(table: PaperTable, family: str) -> str:
    some = table.where(family=family)
    of, free = some.column("colliding")[0], some.column("reported though free")
    found = dict(zip(some.column("algorithm"), some.column("detected"), strict=True))
    names = ("exact", "qaco memetic", "qaco local", "qaco corrected", "qaco random", "qaco printed")
    parts = [f"{name} {found[name]}" for name in names]
    false = sum(cell for cell in free if isinstance(cell, int))
    return f"F7e, {family}: of {of} contacts about first touch: {', '.join(parts)}; reported though free: {false}."


def _ablation(table: PaperTable, family: str) -> str:
    parts = []
    for variant in dict.fromkeys(table.column("variant")):
        some = table.where(family=family, variant=variant)
        found = zip(some.column("without"), some.column("detected"), strict=True)
        parts.append(f"{variant} " + ", ".join(f"without {word} {count}" for word, count in found))
    return f"Ablation, {family}: {'; '.join(parts)}."


def _samples(coverage: PaperTable, search: PaperTable, family: str) -> str:
    """The coverage of each sample, and of each search the sample with which it detects most of all poses."""
    sizes, rates = (coverage.where(family=family).column(heading) for heading in ("faces sampled", "rate"))
    covered = ", ".join(f"{size}: {_percent(rate)}" for size, rate in zip(sizes, rates, strict=True) if size != ALL)
    best = []
    for name in SEARCHERS:
        found = search.where(family=family, search=name).column("detected of all poses")
        most = max(range(len(found)), key=lambda k: float(found[k] or 0.0))
        best.append(f"{name} {_percent(found[most])} with {sizes[most]} ({_percent(found[-1])} with all)")
    return (
        f"F8, {family}: a sample of so many faces holds no pair of a contact in {covered}; at the same evaluations "
        f"most contacts are detected by {', '.join(best)}."
    )
