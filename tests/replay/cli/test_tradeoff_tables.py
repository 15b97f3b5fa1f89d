import io
import sys
from dataclasses import replace

import pytest
from rich.console import Console
from support.small_worlds import cubes

from replay.base.wilson import OVER_CONTACTS
from replay.cli.console import People
from replay.cli.terminal import terminal
from replay.cli.tradeoff_tables import pareto_bar, pareto_table, pareto_words
from replay.outputs.tradeoff_table import how_measured
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


def test_nothing_is_cut_in_80_columns(done):
    text = printed(pareto_table(done, everything=True), 80)
    assert "…" not in text and all(row["label"] in text for row in done.rows)


def test_the_machine_is_named_and_that_it_did_other_work_only_where_it_did(done):
    quiet, busy = (replace(done, about={**done.about, "processor_share": share}) for share in (0.98, 0.4))
    said = [" ".join(printed(pareto_table(one)).split()) for one in (quiet, busy)]
    assert all(done.about["machine"]["processor"] in one for one in said)
    assert ["busy with other work for 60 % of the time" in one for one in said] == [False, True]
    assert "other work" not in said[0]


def test_how_it_was_measured_stands_below_the_table(done):
    said = " ".join(printed(pareto_table(done)).split())
    assert all(" ".join(one.split()) in said for one in how_measured(done))
    check = {**done.about["clock"]["live"], "tie": False, "widened": 1.4, "low": 1.3, "high": 1.5, "ratio": 1.4}
    clock = {"live": check, "offline": {**check, "passes": 1, "low": None, "high": None}}
    (live, offline) = how_measured(replace(done, about={**done.about, "clock": clock}))[2:4]
    assert "gives 1.4 [1.3, 1.5], no tie, so every live interval is widened by 1.4; " in live
    assert "gives 1.4, no tie" in offline and offline.endswith("; 1 pass.")
    bare = replace(done, rows=tuple({**row, "containment": False} for row in done.rows))
    assert "Containment is in, but not of " in (said := how_measured(bare)[5]) and done.front[0] in said


def test_table_and_file_say_what_their_intervals_are_over(done):
    assert OVER_CONTACTS in " ".join(printed(pareto_table(done), 400).split())
    assert done.as_json()["intervals"] == OVER_CONTACTS


def test_the_front_so_far_fits_one_line(done):
    assert pareto_words(done.rows).endswith(" ms 0") and pareto_words([]) == ""


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
