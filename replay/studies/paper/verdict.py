"""What the tables say, one sentence each, every number in it taken from their cells."""

from __future__ import annotations

from collections.abc import Sequence

from replay.outputs.paper_table import Cell, PaperTable
from replay.studies.paper.feature_samples import ALL, SEARCHERS


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


def _cells(table: PaperTable, heading: str, **wanted: Cell) -> list[Cell]:
    """Cells below a heading of the rows whose cells are as wanted; ``_`` stands for a space in a heading."""
    places = {table.head.index(name.replace("_", " ")): cell for name, cell in wanted.items()}
    found = table.column(heading)
    return [
        cell
        for cell, row in zip(found, table.rows, strict=True)
        if all(row[place] == value for place, value in places.items())
    ]


def _percent(cell: Cell) -> str:
    return "-" if cell is None or isinstance(cell, str) else f"{100 * cell:.1f} %"


def _completion(table: PaperTable) -> str:
    whole = [
        str(name)
        for name, poses, every in zip(
            *(table.column(h) for h in ("algorithm", "poses", "poses with every pair")), strict=True
        )
        if poses == every
    ]
    least = min(float(cell) for cell in table.column("precision") if isinstance(cell, float | int))
    return (
        f"T1a: every face pair of all {table.rows[0][1]} poses is found by {', '.join(whole)}; "
        f"the least precision of all rows is {least:g}."
    )


def _caps(table: PaperTable) -> str:
    parts = []
    for cap in dict.fromkeys(table.column("contacts")):
        recalls = [float(cell) for cell in _cells(table, "face recall", contacts=cap) if isinstance(cell, float)]
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
    of = _cells(table, "colliding", family=family)[0]
    parts = [
        f"{name} {_cells(table, 'detected', family=family, algorithm=name)[0]}"
        for name in ("exact", "qaco memetic", "qaco local", "qaco corrected", "qaco random", "qaco printed")
    ]
    false = sum(int(cell) for cell in _cells(table, "reported though free", family=family) if isinstance(cell, int))
    return f"F7e, {family}: of {of} contacts about first touch: {', '.join(parts)}; reported though free: {false}."


def _ablation(table: PaperTable, family: str) -> str:
    parts = []
    for variant in dict.fromkeys(table.column("variant")):
        words = _cells(table, "without", family=family, variant=variant)
        found = _cells(table, "detected", family=family, variant=variant)
        parts.append(f"{variant} " + ", ".join(f"without {w} {f}" for w, f in zip(words, found, strict=True)))
    return f"Ablation, {family}: {'; '.join(parts)}."


def _samples(coverage: PaperTable, search: PaperTable, family: str) -> str:
    """The coverage of each sample, and of each search the sample with which it detects most of all poses."""
    sizes = _cells(coverage, "faces sampled", family=family)
    rates = _cells(coverage, "rate", family=family)
    covered = ", ".join(f"{size}: {_percent(rate)}" for size, rate in zip(sizes, rates, strict=True) if size != ALL)
    best = []
    for name in SEARCHERS:
        found = _cells(search, "detected of all poses", family=family, search=name)
        most = max(range(len(found)), key=lambda k: float(found[k] or 0.0))
        best.append(f"{name} {_percent(found[most])} with {sizes[most]} ({_percent(found[-1])} with all)")
    return (
        f"F8, {family}: a sample of so many faces holds no pair of a contact in {covered}; at the same evaluations "
        f"most contacts are detected by {', '.join(best)}."
    )
