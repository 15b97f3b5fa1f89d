"""A table of the paper: numbers with a key and a note; `plain` is the table that terminal, page and picture show."""

from dataclasses import dataclass, replace

from replay.outputs.tables import Table, table

Cell = str | int | float | None


@dataclass(frozen=True)
class PaperTable:
    """One table."""

    key: str  # of section 6.3, such as ``T1a``
    title: str  # what it shows, in one sentence
    head: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]  # ``None`` is shown as a dash
    note: str = ""  # what a reader must know

    def where(self, **wanted: Cell) -> "PaperTable":
        """The rows whose cells are as wanted, heading by heading."""
        places = {self.head.index(heading): cell for heading, cell in wanted.items()}
        return replace(self, rows=tuple(row for row in self.rows if all(row[k] == one for k, one in places.items())))

    def column(self, heading: str) -> list[Cell]:
        """The cells below a heading."""
        place = self.head.index(heading)
        return [row[place] for row in self.rows]

    @property
    def plain(self) -> Table:
        """The cells as a reader sees them, below key and title; the note at the end."""
        words = [name for name in self.head if any(isinstance(cell, str) for cell in self.column(name))]
        rows = [[shown(cell) for cell in row] for row in self.rows]
        return table(f"{self.key}: {self.title}", self.head, rows, words=words, whole=(), notes=[self.note])


def shown(cell: Cell) -> str:
    """A cell as text: four digits are enough for a reader, from a thousand on whole numbers; the file has all."""
    if cell is None:
        return "-"
    if isinstance(cell, float):
        return f"{cell:,.0f}" if 1e3 <= abs(cell) < 1e12 else f"{cell:.4g}"
    return f"{cell:,}" if isinstance(cell, int) else cell
