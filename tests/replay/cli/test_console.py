import io
import sys

import click
import pytest
from click.testing import CliRunner
from rich.console import Console
from support.small_tables import made

from replay.cli.console import People, TerminalProgress, pace, stdout_console
from replay.cli.options import common, let_modules_here_be_found, lineup, output_format, window
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


@click.command()
@window
@output_format
@common
def command(people, **given):
    click.echo(repr({**given, **vars(people)}))


def test_options_mean_the_same_on_every_verb():
    got = CliRunner().invoke(command, ["--start", "1", "--end", "2.5", "--format", "json", "-v", "-q", "--debug"])
    assert eval(got.output) == {"start": 1.0, "end": 2.5, "as_json": True, "quiet": True, "verbose": True}


def test_nothing_asked_for_is_text_and_the_whole_session():
    got = eval(CliRunner().invoke(command, []).output)
    assert not got["as_json"] and got["start"] is None and got["end"] is None


def test_another_format_is_refused():
    assert CliRunner().invoke(command, ["--format", "xml"]).exit_code == 2


def test_modules_of_the_current_folder_are_found_only_for_a_detector_that_names_one(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.path", [path for path in sys.path if path])
    let_modules_here_be_found(["hybrid", ""])
    assert str(tmp_path) not in sys.path
    let_modules_here_be_found(["mine=engine:Detector"])
    let_modules_here_be_found(["mine=engine:Detector"])
    assert sys.path.count(str(tmp_path)) == 1 and sys.path[-1] == str(tmp_path)


def test_a_lineup_is_asked_for_in_the_same_words_on_every_verb():
    @click.command()
    @lineup
    def alone(**given):
        click.echo(repr(given))

    got = CliRunner().invoke(alone, ["--detector", "hybrid", "--detectors", "static,qaco", "--oracle", "continuous"])
    assert eval(got.output) == {"detectors": ["hybrid", "static,qaco"], "oracle": "continuous", "seed": 0}
