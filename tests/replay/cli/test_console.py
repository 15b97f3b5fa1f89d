import sys
import time

import pytest
from support.processes import Watched
from support.small_worlds import unit_cubes_on_x

from replay import run
from replay.cli.console import People, TerminalProgress, progress_counter, progress_text


def test_people_are_spoken_to_on_stderr_unless_quiet(capsys):
    """Details are for those who asked for more."""
    People().say("hello")
    People(quiet=True).say("nothing")
    People().detail("nothing")
    People(verbose=True).detail("more")
    out, err = capsys.readouterr()
    assert (out, err) == ("", "hello\nmore\n")


def test_broken_gate_is_named_in_quiet_mode(capsys):
    """A broken gate is why a command fails: exit code 4."""
    assert People(quiet=True).gate([]) == 0 and People(quiet=True).gate(["it missed 1"]) == 4
    assert capsys.readouterr().err == "gate: it missed 1\n"


def test_stage_prints_fraction_time_left_and_final_time():
    """3 s for 20 % leave 12 s for the other 80 %."""
    assert [progress_text(0.2, 3.0), progress_text(1.0, 14.2), progress_text(0.0, 5.0)] == [
        " 20 %  12 s left",
        "100 %  14 s",
        "5 s so far",
    ]


def test_without_a_terminal_only_long_stages_print_lines(capsys):
    """A line each 50 ms: a stage that is over before prints none, and a quiet program never does."""
    progress = TerminalProgress(People(), report_interval=0.05)
    with progress.stage("Short", 10) as advance:
        advance(10)
    assert capsys.readouterr().err == ""
    with progress.stage("Long", 10) as advance:
        time.sleep(0.06)
        advance(5)
        advance(5)
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2 and lines[0].startswith("Long:  50 %  ") and lines[1].startswith("Long: 100 %  0 s")
    with TerminalProgress(People(quiet=True), report_interval=0.0).stage("Long") as advance:
        advance(1)
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("long", [0.001, 99.0])
def test_terminal_stage_prints_its_time_once_long(long, capsys, monkeypatch):
    """A wait of 2 ms is long from 1 ms on, short up to 99 s."""
    monkeypatch.setattr("replay.cli.console.LONG_STAGE_S", long)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    with TerminalProgress(People()).stage("Waiting") as advance:
        time.sleep(0.002)
        advance(1)
    output = capsys.readouterr().err
    assert "Waiting" in output and ("100 %  0 s" in output) == (long < 1.0)


@pytest.mark.sampled(6)
@pytest.mark.parametrize("detectors", [None, "exact", "slow=discrete[rate_hz=20],recorded-like=sphere"])
def test_every_stage_of_a_run_reports_all_of_its_work(detectors, tmp_path):
    """Each stage counts up to its total."""
    watched = Watched()
    run(
        unit_cubes_on_x({"a": [0.0] * 6, "b": [3.0, 0.9, 3.0, 0.9, 0.9, 3.0]}),
        detectors=detectors,
        out=tmp_path / "run",
        progress=watched,
    )
    names = [name.split()[0] for name in watched.stages]
    assert names[:3] == ["Examining", "Replaying", "Comparing"] and names[-1] == "Writing"
    assert [(name, total, done) for name, (total, done) in watched.stages.items() if total != done] == []


def test_stored_pieces_do_not_count_in_the_rate(capsys, monkeypatch):
    """One piece is stored; after it each takes 3 s, 20 a minute, by the planted clock."""
    times = iter([0.0, 1.0, 3.0, 6.0, 9.0])
    monkeypatch.setattr("replay.cli.console.time.monotonic", lambda: next(times))
    tell = progress_counter(People(), 4)
    for name, after in {"a": "kept", "b": "done", "c": "it broke", "d": "done"}.items():
        tell(name, after)
    assert capsys.readouterr().err.splitlines() == [
        "   1 of 4  a: kept",
        "   2 of 4  b: done, about 6 s left at 20 a minute",
        "   3 of 4  c: it broke, about 3 s left at 20 a minute",
        "   4 of 4  d: done",
    ]
