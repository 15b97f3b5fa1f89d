"""A table of the paper: numbers with a key and a note, of which a reader is shown four digits."""

from replay.document.tables import Column, Table

Cell = str | int | float | None


def paper_table(key: str, title: str, head: tuple[str, ...], rows: tuple[tuple[Cell, ...], ...], note: str) -> Table:
    """One table; ``key`` is of section 6.3, such as ``T1a``; ``note`` is what a reader must know."""
    text_columns = {name for k, name in enumerate(head) if any(isinstance(row[k], str) for row in rows)}
    columns = (Column(name, str if name in text_columns else float, show=cell_text) for name in head)
    return Table(tuple(columns), rows, title, (note,), key)


def cell_text(cell: Cell) -> str:
    """A cell as text: four digits are enough for a reader, from a thousand on whole numbers; the file has all."""
    if cell is None:
        return "-"
    if isinstance(cell, float):
        return f"{cell:,.0f}" if 1e3 <= abs(cell) < 1e12 else f"{cell:.4g}"
    return f"{cell:,}" if isinstance(cell, int) else cell
