"""The terminal shows the title, the note and every cell of every table."""

from rich.console import Console

from replay.cli.paper_tables import paper_tables
from replay.paper.tables import PaperTable


def test_titles_notes_and_cells_are_printed():
    console = Console(width=80)
    with console.capture() as caught:
        console.print(paper_tables([PaperTable("T1", "a title", ("who", "n"), (("x", 1234), ("y", None)), "a note")]))
    for words in ("T1: a title", "a note", "1,234", "who", "-"):
        assert words in caught.get()


def test_in_a_narrow_terminal_numbers_are_folded_and_never_cut():
    console = Console(width=24)
    row = ("a-long-search", 1.234567, 7654321, 0.000123)
    with console.capture() as caught:
        console.print(paper_tables([PaperTable("T1", "a", ("who", "one", "two", "three"), (row,), "")]))
    assert "…" not in caught.get()
    assert all(caught.get().count(digit) >= 1 for digit in "7654321")
