"""A table as plain data: what computes fills it, and terminal, page and file show the same cells."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

Cell = str | int | float | None


@dataclass(frozen=True)
class PaperTable:
    """One table."""

    key: str  # of section 6.3, such as ``T1a``
    title: str  # what it shows, in one sentence
    # head, rows: headings and cells; ``None`` is shown as a dash
    head: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    note: str = ""  # what a reader must know

    def as_json(self) -> dict[str, Any]:
        """The same as plain data."""
        return dict(vars(self))

    def column(self, heading: str) -> list[Cell]:
        """The cells below a heading."""
        place = self.head.index(heading)
        return [row[place] for row in self.rows]


def shown(cell: Cell) -> str:
    """A cell as text: four digits are enough for a reader, from a thousand on whole numbers; the file has all."""
    if cell is None:
        return "-"
    if isinstance(cell, float):
        return f"{cell:,.0f}" if 1e3 <= abs(cell) < 1e12 else f"{cell:.4g}"
    return f"{cell:,}" if isinstance(cell, int) else cell
