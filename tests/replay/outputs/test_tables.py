"""One table, three renderers: each shows every cell, and a mark never replaces a word."""

import io

import pytest
from page_cells import Cells
from rich.console import Console

from replay.cli.terminal import STYLES, terminal
from replay.outputs import tables
from replay.outputs.tables import Marked, table
from replay.report.markup import page_table
from replay.rerun_log.markdown import markdown

ROWS = [("cup|lid", 1234, Marked("7", tables.STRONG)), ("rod", 0, Marked("x", tables.CODE, "why"))]


def made(**more):
    return table("a title", ("body", "count", "mark"), ROWS, notes=["a note"], **more)


def printed(one, width=60):
    console = Console(width=width, file=io.StringIO())
    console.print(terminal(one))
    return [line.rstrip() for line in console.file.getvalue().splitlines()]


def test_a_terminal_shows_separators_dots_for_zero_and_remarks_below():
    lines = printed(made())
    assert lines[1] == "a title" and lines[-1] == "a note"
    assert [line.split() for line in lines[4:7]] == [["cup|lid", "1,234", "7"], ["rod", "·", "x"], ["why"]]


def test_in_a_narrow_terminal_no_cell_is_cut():
    assert "…" not in "".join(printed(made(), 16))


def test_a_column_is_marked_where_it_is_not_zero():
    console = Console(width=60, file=io.StringIO(), force_terminal=True, color_system="truecolor")
    console.print(terminal(made(marks={"count": tables.MISSED})))
    lines = console.file.getvalue().splitlines()
    red = "38;2;255;45;85"
    assert [red in line for line in lines if "1,234" in line or "rod" in line] == [True, False]


@pytest.mark.parametrize("mark", set(STYLES) - {tables.MISSED, tables.PARTLY})
def test_red_is_for_misses_alone(mark):
    assert "red" not in STYLES[mark] and "#ff2d55" not in STYLES[mark]


def test_a_page_keeps_numbers_plain():
    text = page_table(made(words=("body",)))
    assert Cells(text).tables == {"a title": [["cup|lid", "1234", "7"], ["rod", "0", "x\nwhy"]]}
    assert "<b>7</b>" in text and "<code>x</code>" in text and "<p>a note</p>" in text
    assert '<td class="word">rod</td><td class="number">0</td>' in text


def test_markdown_escapes_what_would_end_a_cell():
    assert markdown(made(), level=2).splitlines() == [
        "## a title", "", "| body | count | mark |", "|---|---|---|", "| cup\\|lid | 1,234 | **7** |",
        "| rod | 0 | `x` |", "", "a note",
    ]  # fmt: skip


def test_columns_are_chosen_by_name_and_in_the_order_asked_for():
    chosen = made().only("mark", "absent", "body")
    assert [column.name for column in chosen.columns] == ["mark", "body"] and chosen.rows[0][1] == "cup|lid"


def test_a_long_table_says_how_much_it_leaves_out_in_a_column_of_words():
    cut = made(words=("mark",)).first(1, "and {} more")
    assert cut.rows == (ROWS[0], ("", "", "and 1 more")) and made().first(2, "{}") == made()
