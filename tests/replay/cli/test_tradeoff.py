import io
import json
import sys
from dataclasses import replace

import pytest
from rich.console import Console
from support.small_worlds import cubes

from replay.cli.console import People
from replay.cli.main import main
from replay.cli.terminal import terminal
from replay.cli.tradeoff_tables import FrontBar, front_table, front_words
from replay.tradeoffs import sweep as trading
from replay.tradeoffs.settings import Setting
from replay.tradeoffs.sweep import tradeoff
from sessions import write_session

PLACES = {"a": [0] * 12, "b": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3]}


@pytest.fixture
def file(tmp_path, monkeypatch):
    rate = Setting("discrete", "step rate", "20 Hz", {"rate_hz": 20.0})
    monkeypatch.setattr(trading, "settings_list", lambda: (Setting("hybrid", "as it comes", ""), rate))
    write_session(cubes(PLACES), tmp_path / "s.mcap")
    return str(tmp_path / "s.mcap")


def test_front_and_advice_are_printed_and_the_folder_is_written(file, tmp_path, capsys):
    assert main(["tradeoff", file, "--out", str(tmp_path / "costs"), "--repeats", "1"]) == 0
    out, err = capsys.readouterr()
    assert err.index("outside the time limit: one audit") < err.index("wrote ")
    assert "hybrid" in out and "To audit a recording" in out and "tradeoff.png" in err
    assert (tmp_path / "costs" / "tradeoff.parquet").is_file()
    assert main(["tradeoff", file, "--out", str(tmp_path / "costs")]) != 0


def test_json_holds_rows_front_and_advice(file, capsys):
    assert main(["tradeoff", file, "--format", "json", "--repeats", "1"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert [row["label"] for row in told["rows"]] == ["hybrid", "discrete step rate 20 Hz"] and told["advice"]


def test_what_a_time_limit_cuts_is_said(file, capsys):
    assert main(["tradeoff", file, "--time-limit", "0"]) == 0
    told = capsys.readouterr().err
    assert "1 of 2 settings were not tried" in told and "discrete step rate 20 Hz" in told


def test_help_says_what_the_time_limit_does_not_count(capsys):
    assert main(["tradeoff", "--help"]) == 0
    assert "Not in it: compiling, and the audit for --out" in " ".join(capsys.readouterr().out.split())


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
    short, whole = printed(front_table(done)), printed(front_table(done, everything=True))
    assert "oracle" in short and "live front" in short and "sphere" not in short and "sphere" in whole


def test_nothing_is_cut_in_80_columns(done):
    text = printed(front_table(done, everything=True), 80)
    assert "…" not in text and all(row["label"] in text for row in done.rows)


def test_the_machine_is_named_and_that_it_did_other_work_only_where_it_did(done):
    quiet, busy = (replace(done, about={**done.about, "processor_share": share}) for share in (0.98, 0.4))
    said = [" ".join(printed(front_table(one)).split()) for one in (quiet, busy)]
    assert all(done.about["machine"]["processor"] in one for one in said)
    assert ["busy with other work for 60% of the time" in one for one in said] == [False, True]
    assert "other work" not in said[0]


def test_the_front_so_far_fits_one_line(done):
    assert front_words(done.rows).endswith("0 %") and front_words([]) == ""


def test_a_bar_is_shown_on_a_terminal_only(done, monkeypatch, capsys):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    with FrontBar(People()) as bar:
        bar.watch(1, 4, "discrete", done.rows)
    assert "discrete" in capsys.readouterr().err
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setenv("TERM", "xterm-256color")
    with FrontBar(People()) as bar:
        bar.watch(123, 212, "hybrid-qaco samples 1920", done.rows)
    assert "123/212" in (said := capsys.readouterr().err) and "0:00:00" in said and "hybrid-qaco samples 1920" in said
    with FrontBar(People(quiet=True)) as bar:
        bar.watch(1, 4, "discrete", done.rows)
    assert capsys.readouterr().err == ""
