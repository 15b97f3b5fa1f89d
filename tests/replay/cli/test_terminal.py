"""A terminal shows every cell whole, and red is for misses alone."""

import io

import pytest
from rich.console import Console
from support.small_tables import made

from replay.cli.terminal import STYLES, terminal
from replay.outputs import tables


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
    console.print(terminal(made(marks={"count": tables.IN_RED})))
    lines = console.file.getvalue().splitlines()
    red = "38;2;255;45;85"
    assert [red in line for line in lines if "1,234" in line or "rod" in line] == [True, False]


@pytest.mark.parametrize("mark", sorted(set(STYLES) - {tables.IN_RED, tables.PARTLY}))
def test_red_is_for_misses_alone(mark):
    assert "red" not in STYLES[mark] and "#ff2d55" not in STYLES[mark]
