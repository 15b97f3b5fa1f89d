import io
import sys

import pytest
from rich.console import Console
from support.small_worlds import cubes

from replay.cli.console import People
from replay.cli.terminal import terminal
from replay.cli.tradeoff_tables import pareto_bar, pareto_table
from replay.tradeoffs.settings import Setting
from replay.tradeoffs.sweep import tradeoff


@pytest.fixture(scope="module")
def done():
    session = cubes({"a": [0] * 12, "b": [3, 1.3, 1.3, 3, 0.9, 3, 1.3, 1.3, 0.9, 0.8, 1.3, 3]})
    names = ("hybrid", "exact", "discrete", "sphere")
    return tradeoff(session, settings=[Setting(name, "as it comes", "") for name in names], repeats=1)


def printed(table, width=200):
    console = Console(width=width, record=True, file=io.StringIO())
    console.print(terminal(table))
    return console.export_text()


def test_the_table_shows_the_front_and_the_oracle_and_on_request_all(done):
    short, whole = printed(pareto_table(done)), printed(pareto_table(done, everything=True))
    assert "oracle" in short and "live front" in short and "sphere" not in short and "sphere" in whole


def test_a_bar_is_shown_on_a_terminal_only(done, monkeypatch, capsys):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    with pareto_bar(People()) as watch:
        watch(1, 4, "discrete", done.rows)
    assert "discrete" in capsys.readouterr().err
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setenv("TERM", "xterm-256color")
    with pareto_bar(People()) as watch:
        watch(123, 212, "hybrid-qaco samples 1920", done.rows)
    assert "123/212" in (said := capsys.readouterr().err) and "0:00:00" in said and "hybrid-qaco samples 1920" in said
    with pareto_bar(People(quiet=True)) as watch:
        watch(1, 4, "discrete", done.rows)
    assert capsys.readouterr().err == ""
