"""What accuracy costs as one plot, laid out in the unit square.

x is the mean time of a frame on a logarithmic axis; y are wrong contacts, 0 on top. Every curve is named beside it, so
there is no legend.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import ceil, floor, log1p, log10
from typing import Final

from replay.base.constants import BUDGET_MS, HEADSET_HZ
from replay.outputs.words import counted
from replay.pipeline.run_result import Tradeoff
from replay.tradeoffs.pareto import Row, counts

BEST, COMPLETE, FAINT, INVENTS = "best", "complete", "faint", "invents"
CURVES: Final = ("first", "second", "third")
"""What a mark stands for; each picture has a colour for it."""

LETTER, LINE = 0.0105, 0.034
"""Width of a letter and height of a line, in shares of a plot: what words need to stand apart."""

TITLE: Final = "Wrong contacts: missed, late or cut short, and false"
X_WORDS: Final = "mean time of a frame, ms (logarithmic)"
TICKS: Final = (0, 1, 3, 10, 30, 100, 300, 1000, 3000, 10_000, 100_000)


@dataclass(frozen=True)
class Mark:
    """A setting in the unit square, y downwards: where it is, the ends of its counts over offsets, what it is."""

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


def plot_of(done: Tradeoff, letters: float = 1.0) -> Plot:
    """The plot, for letters so many times as large."""
    return _Layout(done).plot(letters)


def subtitle(done: Tradeoff) -> tuple[str, str]:
    """What was measured on what, and how: the two lines under the title of a picture."""
    about = done.about
    things = (("bodies", "body", "bodies"), ("pairs", "pair", "pairs"), ("contacts", "contact", "contacts"))
    numbers = ", ".join(counted(about[key], *words) for key, *words in things)
    return (
        f"{about['session']}: {about['seconds'] / 60:.2g} min, {numbers}; reference: {about['oracle']}.",
        "Bars: smallest to largest over 16 sampling offsets. Green: the front.",
    )


class _Layout:
    """Where rows are in the plot, and what they are called there."""

    def __init__(self, done: Tradeoff) -> None:
        self._rows = done.rows
        times = [*(row["mean_ms"] for row in done.rows), BUDGET_MS]
        self._low = floor(log10(min(times)))
        self._high = max(self._low + 1, ceil(log10(max(times))))
        self._most = max([1, *(row["wrong_largest"] for row in done.rows)])
        self._lines = dict(zip(CURVES, _lines(done.rows), strict=False))

    def plot(self, letters: float) -> Plot:
        """Everything in its place; words last, where nothing is."""
        kinds = [(self._kind(row), row) for row in self._rows]
        marks = tuple(self._mark(row, kind) for kind, row in kinds)
        placed = _Placed(marks, letters)
        for kind, line in self._lines.items():
            placed.add(self._mark(line[len(line) // 2], kind), line[0]["line"], strong=True)
        for kind, row in sorted(kinds, key=lambda known: (known[0] != BEST, known[0] == FAINT)):
            named = row["label"] if kind not in CURVES else row["value"]
            placed.add(self._mark(row, kind), named, strong=kind == BEST)
        curves = tuple((kind, tuple(self._mark(row, kind) for row in line)) for kind, line in self._lines.items())
        ticks = [tick for tick in TICKS if tick <= self._most]
        return Plot(
            title=TITLE, x_words=X_WORDS, y_words="wrong contacts",
            x_ticks=tuple((self._x(10.0**k), f"{10.0**k:g}") for k in range(self._low, self._high + 1)),
            y_ticks=tuple((self._y(tick), f"{tick:,}") for tick in ticks),
            budgets=((self._x(BUDGET_MS), f"a frame at {HEADSET_HZ:g} Hz"),),
            curves=curves, marks=marks, words=tuple(placed.words),
        )  # fmt: skip

    def _x(self, value: float) -> float:
        return (log10(value) - self._low) / (self._high - self._low)

    def _y(self, wrong: float) -> float:
        """Logarithmic, with room for none: spheres have ten times as many wrong contacts as anything else."""
        return log1p(wrong) / log1p(self._most)

    def _mark(self, row: Row, kind: str) -> Mark:
        middle, low, high = (self._y(row[name]) for name in ("wrong", "wrong_smallest", "wrong_largest"))
        return Mark(self._x(row["mean_ms"]), middle, low, high, kind)

    def _kind(self, row: Row) -> str:
        if row["front"]:
            return BEST
        for kind, line in self._lines.items():
            if any(row is other for other in line):
                return kind
        return COMPLETE if row["complete"] else FAINT


def _lines(rows: Iterable[Row]) -> list[list[Row]]:
    """The first lines of the table with several settings that count, each from what has most wrong contacts on."""
    lines: dict[str, list[Row]] = {}
    for row in rows:
        if row["line"] and counts(row):
            lines.setdefault(row["line"], []).append(row)
    return [sorted(line, key=lambda row: float(row["mean_ms"])) for line in lines.values() if len(line) > 1]


class _Placed:
    """Words beside their marks: each where neither words nor marks are yet; what finds no room stays out."""

    def __init__(self, marks: Sequence[Mark], letters: float) -> None:
        self._letter, self._line = LETTER * letters, LINE * letters
        self.words: list[Words] = []
        self._taken = [(mark.x - 0.008, mark.y - 0.012, mark.x + 0.008, mark.y + 0.012) for mark in marks]

    def add(self, mark: Mark, text: str, *, strong: bool = False) -> None:
        """Words of a mark: right or left of it, then further and further away."""
        wide = self._letter * len(text) * (1.15 if strong else 1.0)
        for step in range(8):
            for side in (0.5, -0.5, 0.0):
                x = mark.x + side * (wide + 0.03)
                for y in (mark.y - step * self._line, mark.y + step * self._line):
                    box = (x - wide / 2, y - self._line / 2, x + wide / 2, y + self._line / 2)
                    # Above 0 is room for the names of what is always right.
                    inside = box[0] >= 0.0 and box[2] <= 1.0 and box[1] >= -0.17 and box[3] <= 1.0
                    if inside and not any(_meet(box, other) for other in self._taken):
                        self._taken.append(box)
                        self.words.append(Words(x, y, text, mark.kind, strong))
                        return


def _meet(a: tuple[float, float, float, float], b: tuple[float, float, float, float]) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]
