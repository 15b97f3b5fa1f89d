"""What accuracy costs as two plots, live and offline, laid out in the unit square.

x is a time on a logarithmic axis; y are contacts missed, 0 on top. Every curve is named beside it, so there is no
legend; what invents more than it finds is a ring apart from the curves.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import ceil, floor, inf, log10
from typing import Final

from replay.base.constants import HEADSET_HZ
from replay.outputs.words import counted
from replay.pipeline.gates import figure
from replay.pipeline.run_result import Tradeoff
from replay.tradeoffs.pareto import LIVE, RATES_HZ, WHOLE, Columns, Row, best_of, budget_ms, counts
from replay.tradeoffs.settings import AS_IT_COMES

BEST, COMPLETE, FAINT, INVENTS = "best", "complete", "faint", "invents"
CURVES: Final = ("first", "second", "third")
"""What a mark stands for; each picture has a colour for it."""

LETTER, LINE = 0.0105, 0.034
"""Width of a letter and height of a line, in shares of a plot: what words need to stand apart."""

WORDS: Final = {
    "step rate": "looked at less often", "budget": "given less to spend", "samples": "fewer samples",
    "mesh resolution": "coarser meshes", "tolerance": "other tolerances", "shape": "in simple shapes",
}  # fmt: skip
"""Axis of a curve -> what is done along it."""

TITLES: Final = {
    LIVE: ("LIVE: frame by frame, as an engine asks", "p99 time of one frame, ms (logarithmic)"),
    WHOLE: ("OFFLINE: the whole session at once", "seconds of computing per minute of session (logarithmic)"),
}


@dataclass(frozen=True)
class Mark:
    """A setting in the unit square, y downwards: where it is, the ends of its interval over contacts, what it is."""

    x: float
    y: float
    low: float
    high: float
    kind: str


@dataclass(frozen=True)
class Words:
    """Words centred on a place."""

    x: float
    y: float
    text: str
    kind: str
    strong: bool = False


@dataclass(frozen=True)
class Plot:
    """One plot: ``ticks`` and ``budgets`` are places on an axis and their words; ``curves`` join marks."""

    title: str
    x_words: str
    y_words: str
    x_ticks: tuple[tuple[float, str], ...]
    y_ticks: tuple[tuple[float, str], ...]
    budgets: tuple[tuple[float, str], ...]
    curves: tuple[tuple[str, tuple[Mark, ...]], ...]
    marks: tuple[Mark, ...]
    words: tuple[Words, ...]


def plots_of(done: Tradeoff, letters: float = 1.0) -> tuple[Plot, Plot]:
    """The live plot and the offline one, for letters so many times as large; they share no axis."""
    return _Layout(done, LIVE).plot(letters), _Layout(done, WHOLE).plot(letters)


def subtitle(done: Tradeoff) -> tuple[str, str]:
    """What was measured on what, and how: the two lines under the title of a picture."""
    about, rows = done.about, [row for row in done.rows if row["front"] or row["front_online"]]
    passes = min((row["live_passes"] for row in done.rows if row["front_online"]), default=0)
    phases = max((row["phases"] for row in done.rows), default=1)
    things = (("bodies", "body", "bodies"), ("pairs", "pair", "pairs"), ("contacts", "contact", "contacts"))
    counts = ", ".join(counted(about[key], *words) for key, *words in things)
    how = f"{counted(passes, 'live pass', 'live passes')}, {counted(phases, 'look phase')}"
    contained = "in" if all(row["containment"] for row in rows) else "not in everywhere"
    return (
        f"{about['session']}: {about['seconds'] / 60:.2g} min, {counts}; trusted: {about['oracle']}. {how}. "
        f"Containment {contained}, faces out.",
        "Bars: 95 % interval over contacts. Rings invent more than they find.",
    )


class _Layout:
    """Where rows are in one plot, and what they are called there."""

    def __init__(self, done: Tradeoff, time: Columns) -> None:
        self._time, self._rows = time, [row for row in done.rows if row[time[0]] is not None]
        minutes = done.about["seconds"] / 60 or 1.0
        self._scale = 1.0 if time == LIVE else done.about["frames"] / 1e3 / minutes
        self._budgets = [(budget_ms(rate), f"{rate:g} Hz") for rate in RATES_HZ] if time == LIVE else []
        times = [*(row[time[0]] * self._scale for row in self._rows), *(ms for ms, _ in self._budgets)]
        self._low = floor(log10(min(times, default=1.0)))
        self._high = max(self._low + 1, ceil(log10(max(times, default=1.0))))
        self._contacts = max((row["contacts"] for row in self._rows), default=1)
        self._best = best_of(self._rows, time, budget_ms(HEADSET_HZ) if time == LIVE else inf)
        self._lines = dict(zip(CURVES, _lines(self._rows), strict=False))

    def plot(self, letters: float) -> Plot:
        """Everything in its place; words last, where nothing is."""
        title, x_words = TITLES[self._time]
        kinds = [(self._kind(row), row) for row in self._rows]
        marks = tuple(self._mark(row, kind) for kind, row in kinds)
        placed = _Placed(marks, letters)
        for kind, line in self._lines.items():
            name = f"{line[0]['detector']}, {WORDS.get(line[0]['axis'], line[0]['axis'])}"
            placed.add(self._mark(line[len(line) // 2], kind), name, strong=True)
        for kind, row in sorted(kinds, key=lambda one: (one[0] != BEST, one[0] == FAINT)):
            false = f": {figure(100 * (1 - row['precision']))} % false" if kind == INVENTS and row["precision"] else ""
            name = row["value"] if kind in CURVES else f"{row['label']}{false}"
            placed.add(self._mark(row, kind), name, strong=kind == BEST)
        curves = tuple((kind, tuple(self._mark(row, kind) for row in line)) for kind, line in self._lines.items())
        steps = sorted({round(self._contacts * k / 6) for k in range(7)})
        return Plot(
            title, x_words, f"contacts missed, whole or in part, of {self._contacts}",
            tuple((self._x(10.0**k), f"{10.0**k:g}") for k in range(self._low, self._high + 1)),
            tuple((step / self._contacts, f"{step}") for step in steps),
            tuple((self._x(ms), words) for ms, words in self._budgets), curves, marks, tuple(placed.words),
        )  # fmt: skip

    def _x(self, value: float) -> float:
        return (log10(value) - self._low) / (self._high - self._low)

    def _mark(self, row: Row, kind: str) -> Mark:
        lost, low, high = (row[name] / self._contacts for name in ("contacts_lost", "lost_low", "lost_high"))
        return Mark(self._x(row[self._time[0]] * self._scale), lost, low, high, kind)

    def _kind(self, row: Row) -> str:
        if row is self._best:
            return BEST
        for kind, line in self._lines.items():
            if any(row is one for one in line):
                return kind
        return INVENTS if not counts(row) else COMPLETE if row["complete"] else FAINT


def _lines(rows: Iterable[Row]) -> list[list[Row]]:
    """The first lines of the table with several settings that count, each from what misses most on."""
    lines: dict[str, list[Row]] = {}
    for row in rows:
        if row["axis"] != AS_IT_COMES and counts(row):
            lines.setdefault(row["line"], []).append(row)
    return [sorted(line, key=lambda row: -float(row["contacts_lost"])) for line in lines.values() if len(line) > 1]


class _Placed:
    """Words beside their marks: each where neither words nor marks are yet; what finds no room stays out."""

    def __init__(self, marks: Sequence[Mark], letters: float) -> None:
        self._letter, self._line = LETTER * letters, LINE * letters
        self.words: list[Words] = []
        self._taken = [(one.x - 0.008, one.y - 0.012, one.x + 0.008, one.y + 0.012) for one in marks]

    def add(self, mark: Mark, text: str, *, strong: bool = False) -> None:
        """Words of a mark: right or left of it, then further and further away."""
        wide = self._letter * len(text) * (1.15 if strong else 1.0)
        for step in range(8):
            for side in (0.5, -0.5, 0.0):
                x = mark.x + side * (wide + 0.03)
                for y in (mark.y - step * self._line, mark.y + step * self._line):
                    box = (x - wide / 2, y - self._line / 2, x + wide / 2, y + self._line / 2)
                    # Above 0 is room for the names of what misses nothing.
                    inside = box[0] >= 0.0 and box[2] <= 1.0 and box[1] >= -0.17 and box[3] <= 1.0
                    if inside and not any(_meet(box, other) for other in self._taken):
                        self._taken.append(box)
                        self.words.append(Words(x, y, text, mark.kind, strong))
                        return


def _meet(one: tuple[float, float, float, float], other: tuple[float, float, float, float]) -> bool:
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]
