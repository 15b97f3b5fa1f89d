"""The front, ties and the advice, from the table alone.

Times are compared by their intervals. Where intervals overlap, or one is not known, the times are a tie: it goes to
what loses fewer contacts, then to the complete detector, then to the simpler one. What leaves contact undecided, and
rows of whose reported pair-frames fewer than ``PRECISION`` are true (a detector that always reports contact misses
nothing), are in the table and not on the front.
"""

from collections.abc import Mapping, Sequence
from itertools import groupby
from math import inf
from typing import Any, Final, TypeAlias

from replay.base.constants import HEADSET_HZ
from replay.pipeline.gates import figure
from replay.pipeline.headline import TOO_SMALL

Row: TypeAlias = Mapping[str, Any]
Columns: TypeAlias = tuple[str, str, str]
"""A time and the ends of its interval."""

LIVE: Final[Columns] = ("p99_ms", "p99_low", "p99_high")
WHOLE: Final[Columns] = ("ms_per_frame", "ms_low", "ms_high")

PRECISION: Final = 0.5
"""Share of the reported pair-frames that must be contacts; below it most alarms are false."""

RATES_HZ: Final = (60.0, 72.0, HEADSET_HZ, 120.0)
"""Frame rates of headsets, for whose budgets there is advice."""

NONE: Final = "nothing tried live is surely in time and right in most of its reports"


def budget_ms(rate_hz: float) -> float:
    """Milliseconds of a frame."""
    return 1e3 / rate_hz


def counts(row: Row) -> bool:
    """Whether a row may be on a front: of one that left contact undecided nobody knows what it misses."""
    decided = row["precision"] is not None and not row.get("contact_frames_undecided")
    return decided and bool(row["precision"] >= PRECISION)


def tied(a: Row, b: Row, time: Columns) -> bool:
    """Whether the intervals of two times overlap, or one of them is not known."""
    ends = [_ends(row, time) for row in (a, b)]
    return ends[0][0] <= ends[1][1] and ends[1][0] <= ends[0][1]


def _ends(row: Row, time: Columns) -> tuple[float, float]:
    low, high = row[time[1]], row[time[2]]
    return -inf if low is None else low, inf if high is None else high


def winner_of(rows: Sequence[Row], time: Columns) -> Row:
    """Of the quickest row and all that tie with it, the one to name; of equals the earlier in the table."""
    quickest = min(rows, key=lambda row: float(row[time[0]]))
    ties = [row for row in rows if tied(row, quickest, time)]
    return min(ties, key=lambda row: (row["contacts_lost"], not row["complete"], row["simplicity"]))


def front_of(rows: Sequence[Row], time: Columns = WHOLE) -> list[str]:
    """Labels on the front, quickest first: each loses fewer contacts than all before it."""
    left = [row for row in rows if counts(row) and row[time[0]] is not None]
    front: list[str] = []
    while left:
        best = winner_of(left, time)
        front.append(best["label"])
        left = [row for row in left if row["contacts_lost"] < best["contacts_lost"]]
    return front


def best_of(rows: Sequence[Row], time: Columns, most: float = inf) -> Row | None:
    """What loses fewest contacts, of those whose whole interval is at most ``most``; ``None``: there is none."""
    fits = [row for row in rows if row[time[0]] is not None and (_ends(row, time)[1] <= most or most == inf)]
    labels = front_of(fits, time)
    return next((row for row in fits if labels and row["label"] == labels[-1]), None)


def advice_of(rows: Sequence[Row]) -> list[str]:
    """Sentences: what to take in a live loop at each frame rate, and for a recording at each price."""
    return [*_live_advice(rows), *_whole_advice(rows)]


def _live_advice(rows: Sequence[Row]) -> list[str]:
    live = [row for row in rows if row[LIVE[0]] is not None]
    chosen = [(best_of(live, LIVE, budget_ms(rate)), rate) for rate in RATES_HZ if live]
    sentences = []
    for label, some in groupby(chosen, key=lambda one: None if one[0] is None else one[0]["label"]):
        found = list(some)
        best, rates = found[0][0], _listed([f"{rate:g}" for _, rate in found])
        if best is None:
            sentences.append(f"In a live loop at {rates} Hz, {NONE}.")
            continue
        share = f"{figure(100 * best['p99_ms'] / budget_ms(HEADSET_HZ))} % of a {HEADSET_HZ:g} Hz frame"
        took = f"it takes {best['mean_ms']:.3g} ms in the mean; its p99 is {_between(best, LIVE, 'ms')}, {share}"
        sentences.append(
            f"In a live loop at {rates} Hz, take {label}: {_faults(best)}; {took}{_ties(rows, best, LIVE)}."
        )
    return sentences


def _whole_advice(rows: Sequence[Row]) -> list[str]:
    by_label = {row["label"]: row for row in rows}
    sentences: list[str] = []
    for label in reversed(front_of(rows, WHOLE)):
        row = by_label[label]
        what = "For less time" if sentences else "To audit a recording"
        minute = f"{row['seconds_per_minute']:.2g} s for a minute of it"
        sentences.append(f"{what}, take {label}: {_faults(row)}; it takes {minute}{_ties(rows, row, WHOLE)}.")
    return sentences


def _ties(rows: Sequence[Row], best: Row, time: Columns) -> str:
    """The other settings that lose as few contacts and whose time is a tie."""
    others = [
        row["label"] for row in rows
        if row is not best and counts(row) and row[time[0]] is not None
        and row["contacts_lost"] <= best["contacts_lost"] and tied(row, best, time)
    ]  # fmt: skip
    return f"; a tie with {_listed(others)}" if others else ""


def _listed(words: Sequence[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def _between(row: Row, time: Columns, unit: str) -> str:
    value, low, high = (row[name] for name in time)
    return f"{value:.3g} {unit}" + ("" if low is None or high is None else f" [{low:.3g}, {high:.3g}]")


def _faults(row: Row) -> str:
    """What it loses of the contacts, and invents of its reports; the trusted one is what the others are held to."""
    if row["oracle"] and not row["contacts_lost"]:
        return "it is what the others are compared with"
    what = f"it misses {lost_words(row)}"
    if row["precision"] < 1.0:
        what += f", and {figure(100 * (1 - row['precision']))} % of what it reports is false"
    return what


def lost_words(row: Row) -> str:
    """``none of 18 contacts``, ``16 of 18 contacts, whole or in part``; a mean over phases has a digit more."""
    lost, of = row["contacts_lost"], row["contacts"]
    if not lost:
        return f"none of {of} contacts"
    return f"{lost:.{1 if row['phases'] > 1 else 0}f} of {of} contacts, whole or in part"


def answer_of(rows: Sequence[Row]) -> str:
    """The answer in two numbers: what the best costs live of a frame, and what sampling less often saves.

    Saved is time a frame in the mean: a slow sample, which p99 is, gets no quicker by being asked for less often.
    """
    best, frame = best_of(rows, LIVE, budget_ms(HEADSET_HZ)), budget_ms(HEADSET_HZ)
    if best is None:
        return f"For {HEADSET_HZ:g} Hz {NONE}"
    miss = "Missing nothing" if not best["contacts_lost"] else f"Missing {lost_words(best)},"
    share = f"{figure(100 * best['p99_ms'] / frame)} % of a {HEADSET_HZ:g} Hz frame"
    cost = f"{miss} costs {best['mean_ms']:.3g} ms a frame in the mean, p99 {share}"
    rare = [row["mean_ms"] for row in rows if row["phases"] > 1 and row["mean_ms"] is not None]
    if not rare:
        return cost
    saved = best["mean_ms"] - min(rare)
    if saved <= 0:
        return f"{cost}: what sampling less often saves is {TOO_SMALL}"
    return f"{cost}: sampling less often saves {saved:.2g} ms a frame at most"
