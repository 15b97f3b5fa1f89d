"""The Pareto front and the advice, from the table alone.

A row is on the front when no other is at least as quick and misses no more. These rows do not count: the oracle and
rows with its algorithm, rows that left contact undecided, and rows of whose reported pair-frames fewer than
``PRECISION`` are true (a detector that always reports contact misses nothing). A row that invents contacts is advised
with the share of its reports that is invented, beside a row that invents less for the same price, and it never
dominates one that invents less.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Final, TypeAlias

from replay.base.constants import BUDGET_MS
from replay.pipeline.gates import percent

Row: TypeAlias = Mapping[str, Any]

PRECISION: Final = 0.5
"""Share of the reported pair-frames that must be contacts; below it most alarms are false."""

OFFLINE_BUDGETS_MS: Final = (0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0)
ONLINE_BUDGETS_MS: Final = (0.1, 0.3, 1.0, 3.0, round(BUDGET_MS, 1))


def counts(row: Row) -> bool:
    """Whether a row may be on the front: of one that left contact undecided nobody knows what it misses."""
    decided = row["precision"] is not None and not row.get("contact_frames_undecided")
    return not row["oracle"] and decided and bool(row["precision"] >= PRECISION)


def front_of(rows: Sequence[Row], *, time: str = "ms_per_frame", online: bool = False) -> list[str]:
    """Labels on the front, quickest first by the column ``time``; of equals the earlier in the table.

    With ``online`` only rows timed frame by frame.
    """
    asked = [row for row in rows if counts(row) and (row["online"] or not online)]
    front: list[Row] = []
    for row in sorted(asked, key=lambda one: (one[time], one["missed"])):
        if not front or row["missed"] < front[-1]["missed"]:
            front.append(row)
    return [row["label"] for row in front]


def advice_of(rows: Sequence[Row]) -> list[str]:
    """Sentences: what to take at which price, for a recording and for a live loop, or that one setting dominates."""
    whole = _advice(rows, "ms_per_frame", OFFLINE_BUDGETS_MS, online=False)
    live = _advice(rows, "p99_ms", ONLINE_BUDGETS_MS, online=True)
    return [f"To audit a recording, {one}." for one in whole] + [f"To ship in a live loop, {one}." for one in live]


def _advice(rows: Sequence[Row], time: str, budgets: Sequence[float], *, online: bool) -> list[str]:
    asked = [row for row in rows if counts(row) and (row["online"] or not online)]
    by_label = {row["label"]: row for row in asked}
    front = [by_label[label] for label in front_of(rows, time=time, online=online)]
    if len(front) == 1:
        return [_alone(front[0], asked, time)]
    sentences, last = [], ""
    for budget in budgets:
        fits = [row for row in front if row[time] <= budget]
        if fits and fits[-1]["label"] != last:
            last = fits[-1]["label"]
            what = "with p99 under" if online else "at"
            clean = _truest([row for row in asked if row[time] <= budget], time)
            sentences.append(f"{what} {budget:g} ms per frame: {_price(fits[-1])}{_instead(fits[-1], clean)}")
    return sentences


def _alone(best: Row, asked: Sequence[Row], time: str) -> str:
    """The sentence for the only row on the front: it dominates, unless another invents less."""
    truest = _truest(asked, time)
    if len(asked) == 1:
        return f"only {best['label']} was tried that reports more contacts than it invents: it {_errors(best)}"
    if truest["precision"] <= best["precision"]:
        others = f"{len(asked) - 1} other" + "s" * (len(asked) > 2)
        return (
            f"{best['label']} dominates {others}: nothing is quicker, misses less or invents less: it {_errors(best)}"
        )
    return f"nothing is quicker or misses less than {_price(best)}{_instead(best, truest)}"


def _truest(rows: Sequence[Row], time: str) -> Row:
    """The row that invents least; of equals the one that misses least, then the quickest."""
    return min(rows, key=lambda row: (-row["precision"], row["missed"], row[time]))


def _instead(advised: Row, truest: Row) -> str:
    """What invents less for the same price."""
    if truest["precision"] <= advised["precision"]:
        return ""
    return f"; to invent {'nothing' if truest['precision'] == 1.0 else 'less'}, {_price(truest)}"


def _price(row: Row) -> str:
    return f"{row['label']}, {_errors(row)}"


def _errors(row: Row) -> str:
    """Shares missed of the contacts, and invented of the reports; no miss is rounded to none."""
    missed = {"share": row["missed"], "low": row["missed_low"], "high": row["missed_high"]}
    if row["precision"] == 1.0:
        return f"misses {percent(missed)}"
    least, most = 1 - row["precision_high"], 1 - row["precision_low"]
    return f"misses {percent(missed)}, invents {percent({'share': 1 - row['precision'], 'low': least, 'high': most})}"
