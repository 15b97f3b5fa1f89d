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
