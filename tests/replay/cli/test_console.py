import io
import sys

import pytest
from rich.console import Console
from support.small_tables import made

from replay.cli.console import People, TerminalProgress, pace, stdout_console
from replay.cli.terminal import STYLES, terminal
from replay.outputs import tables


def test_people_are_spoken_to_on_stderr_unless_quiet(capsys):
    People().say("hello")
    People(quiet=True).say("nothing")
    People().detail("nothing")
    People(verbose=True).detail("more")
    out, err = capsys.readouterr()
    assert (out, err) == ("", "hello\nmore\n")


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.mark.parametrize(
    ("stream", "quiet", "shown"), [(Terminal, False, True), (Terminal, True, False), (io.StringIO, False, False)]
)
def test_bars_are_drawn_on_a_terminal_only(monkeypatch, stream, quiet, shown):
    err = stream()
    monkeypatch.setattr(sys, "stderr", err)
    monkeypatch.setenv("TERM", "xterm-256color")
    with TerminalProgress(People(quiet=quiet)).stage("hybrid", 10) as advance:
        advance(4)
        advance(6)
    with TerminalProgress(People(quiet=quiet)).stage("write"):
        pass
    assert ("hybrid" in err.getvalue()) == shown and ("write" in err.getvalue()) == shown


def test_tables_lose_nothing_where_there_is_no_terminal(capsys):
    stdout_console().print("x" * 159)
    assert capsys.readouterr().out == "x" * 159 + "\n"


def test_a_running_stage_says_its_rate_and_the_time_left():
    assert pace(12345.6, 3.4, 1.0, False, "frames") == "12,346 frames/s, 3 s left"


def test_a_stage_that_is_done_or_has_no_rate_says_the_time_it_took():
    assert pace(12345.6, 0.0, 4.06, True, "frames") == "4.1 s"
    assert pace(None, None, 2.0, False, "frames") == "2.0 s"
    assert pace(None, None, None, False, "frames") == ""


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
