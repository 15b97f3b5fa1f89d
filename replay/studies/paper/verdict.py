"""What the tables say: sentences on completeness, caps, frames, the colony and samples of faces."""

from collections.abc import Sequence
from typing import Any

from replay.outputs.paper_table import Cell, PaperTable
from replay.studies.paper.experiment import PaperResult
from replay.studies.paper.feature_samples import ALL, SEARCHERS


def as_json(result: PaperResult) -> dict[str, Any]:
    """Everything as plain data: verdict, experiment, tables."""
    return {
        "version": 3,
        "verdict": verdict_of(result.tables),
        "experiment": result.experiment,
        "hard_fixtures": result.hard,
        "tables": [vars(one) for one in result.tables],
    }


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
