"""A table over raw values: Parquet and JSON carry every column as it is, a screen shows some of them as people read."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

from replay.outputs.tables import Cell, Table, table

if TYPE_CHECKING:
    import pyarrow as pa

NUMBERS: Final = (int, float)


@dataclass(frozen=True)
class Column:
    """One column: what a row has there, and how people read it. A value that nobody measured is ``None``."""

    name: str
    dtype: type  # ``str``, ``int``, ``float`` or ``bool``
    meaning: str
    of: str = ""  # where a row has it, attributes and places with dots: ``match.overlap``; ``""``: under its name
    unit: str = ""
    head: str = ""  # above it on a screen; ``""``: its name
    format: str = ""  # of a value on a screen, as Python writes it: ``.3f``
    scale: float = 1.0  # what a value is multiplied with on a screen: 1000, where millimetres are read and metres kept

    def value(self, row: Any) -> Any:
        """What a row has there; ``None`` where a part on the way is none, or not a number."""
        found = row
        for part in (self.of or self.name).split("."):
            if found is None:
                return None
            found = found[int(part)] if part.isdigit() else getattr(found, part)
        return None if found != found else found

    def cell(self, value: Any) -> Cell:
        """A value as people read it; ``None`` as nothing."""
        if value is None:
            return ""
        if self.dtype is float:
            return f"{value * self.scale:{self.format}}"
        return value if self.dtype is int else str(value)


@dataclass(frozen=True)
class RawTable:
    """Columns, and the values of each row below them."""

    columns: tuple[Column, ...]
    rows: tuple[tuple[Any, ...], ...]

    @staticmethod
    def of(columns: Sequence[Column], rows: Iterable[Any]) -> "RawTable":
        """Every column of every row."""
        return RawTable(tuple(columns), tuple(tuple(column.value(row) for column in columns) for row in rows))

    def where(self, **wanted: Any) -> "RawTable":
        """The rows with these values."""
        places = {self._place(name): value for name, value in wanted.items()}
        return replace(self, rows=tuple(row for row in self.rows if all(row[k] == one for k, one in places.items())))

    def by(self, key: Callable[[dict[str, Any]], Any]) -> "RawTable":
        """The rows in the order of what is made of each."""
        order = sorted(zip(self.plain(), self.rows, strict=True), key=lambda pair: key(pair[0]))
        return replace(self, rows=tuple(row for _, row in order))

    def plain(self) -> list[dict[str, Any]]:
        """The rows as JSON has them, column -> value."""
        return [dict(zip([column.name for column in self.columns], row, strict=True)) for row in self.rows]

    def to_arrow(self) -> "pa.Table":
        """All columns, each of its type."""
        import pyarrow as pa

        from replay.outputs.results.parquet import columns_of

        # Not by rows as JSON has them: 68,000 contacts of two hours would take 80 MB for a moment.
        return pa.table(columns_of(self.rows, types_of(self.columns)))

    def to_pandas(self) -> Any:
        """All columns as a data frame; needs pandas."""
        return self.to_arrow().to_pandas()

    def shown(self, title: str, *names: str, words: Mapping[str, Sequence[Cell]] | None = None) -> Table:
        """Some columns as people read them; ``words``: head -> cells of columns that are made of several."""
        made = dict(words or {})
        heads, cells, worded = [], [], []
        for name in names:
            if name in made:
                heads.append(name)
                cells.append(list(made[name]))
                worded.append(name)
                continue
            place = self._place(name)
            column = self.columns[place]
            heads.append(column.head or column.name)
            cells.append([column.cell(row[place]) for row in self.rows])
            if column.dtype not in NUMBERS:
                worded.append(heads[-1])
        return table(title, heads, zip(*cells, strict=True), words=worded, whole=heads[:3])

    def _place(self, name: str) -> int:
        return next(k for k, column in enumerate(self.columns) if column.name == name)


def types_of(columns: Sequence[Column]) -> dict[str, type]:
    """Column -> type."""
    return {column.name: column.dtype for column in columns}
