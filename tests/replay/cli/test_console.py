import sys
import time

import pytest
from support.processes import Watched
from support.small_worlds import unit_cubes_on_x

from replay import run
from replay.cli.console import People, TerminalProgress, progress_counter, progress_text


def test_people_are_spoken_to_on_stderr_unless_quiet(capsys):
    """``People`` prints sentences for people beside a command's output; details only where ``-v`` asks for them."""
    People().say("hello")
    People(quiet=True).say("nothing")
    People().detail("nothing")
    People(verbose=True).detail("more")
    out, err = capsys.readouterr()
    assert (out, err) == ("", "hello\nmore\n")


def test_broken_gate_is_named_in_quiet_mode(capsys):
    """A gate is a limit that the user sets, and a broken one why a command fails with exit code 4.

    Without a broken gate nothing is printed, and the code is 0.
    """
    quiet = People(quiet=True)
    assert quiet.gate([]) == 0
    assert quiet.gate(["it missed 1"]) == 4
    assert capsys.readouterr().err == "gate: it missed 1\n"


@pytest.mark.parametrize(
    ("fraction", "seconds", "text"),
    [
        (0.2, 3.0, " 20 %  12 s left"),  # 3 s for 20 % leave 12 s for the other 80 %
        (1.0, 14.2, "100 %  14 s"),
        (0.0, 5.0, "5 s so far"),
    ],
    ids=["in between", "at the end", "nothing done"],
)
def test_stage_prints_fraction_time_left_and_final_time(fraction, seconds, text):
    """``fraction``: of a stage's work that is done after so many seconds."""
    assert progress_text(fraction, seconds) == text


def test_short_stage_prints_no_line_without_a_terminal(capsys):
    """A line may be printed each 50 ms; the stage of ten steps is over before."""
    with TerminalProgress(People(), report_interval=0.05).stage("Short", 10) as advance:
        advance(10)
    assert capsys.readouterr().err == ""


def test_long_stage_prints_lines_without_a_terminal(capsys):
    """A line may be printed each 50 ms; half of ten steps are done after 60 ms, the others at once: the last line."""
    with TerminalProgress(People(), report_interval=0.05).stage("Long", 10) as advance:
        time.sleep(0.06)
        advance(5)
        advance(5)
    half, end = capsys.readouterr().err.splitlines()
    assert half.startswith("Long:  50 %  ")
    assert end.startswith("Long: 100 %  0 s")


def test_stage_without_a_total_prints_its_time_so_far(capsys):
    """A stage that does not state its amount of work prints its time, not percent, before its end.

    With an interval of 0 s between lines each step of the work prints one.
    """
    with TerminalProgress(People(), report_interval=0.0).stage("Long") as advance:
        advance(1)
    assert capsys.readouterr().err.splitlines() == ["Long: 0 s so far", "Long: 100 %  0 s"]


def test_quiet_program_prints_no_stage(capsys):
    """A line might be printed at once (0 s), but the program runs with ``-q``."""
    with TerminalProgress(People(quiet=True), report_interval=0.0).stage("Long") as advance:
        advance(1)
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(("long_from_s", "prints_time"), [(0.001, True), (99.0, False)])
def test_terminal_stage_prints_its_time_once_long(long_from_s, prints_time, capsys, monkeypatch):
    """In a terminal a stage takes 2 ms; its name is printed, and its time, 0 s, if it is long from 1 ms on."""
    monkeypatch.setattr("replay.cli.console.LONG_STAGE_S", long_from_s)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    with TerminalProgress(People()).stage("Waiting") as advance:
        time.sleep(0.002)
        advance(1)
    output = capsys.readouterr().err
    assert "Waiting" in output and ("100 %  0 s" in output) == prints_time


@pytest.mark.sampled(6)
@pytest.mark.parametrize("detectors", ["slow=discrete[rate_hz=20],recorded-like=sphere", "exact", None])
def test_every_stage_of_a_run_reports_all_of_its_work(detectors, tmp_path):
    """A run over six frames of two cubes by ``detectors`` (label=detector; None: the default) reports its stages.

    They come in order, and the amounts of work reported done in each add up to its total.
    """
    watched = Watched()
    run(
        unit_cubes_on_x({"a": [0.0] * 6, "b": [3.0, 0.9, 3.0, 0.9, 0.9, 3.0]}),
        detectors=detectors,
        out=tmp_path / "run",
        picture=False,
        progress=watched,
    )
    verbs = [name.split()[0] for name in watched.stages]
    assert verbs[:3] == ["Examining", "Replaying", "Comparing"] and verbs[-1] == "Writing"
    assert [(name, total, done) for name, (total, done) in watched.stages.items() if total != done] == []


def test_stored_pieces_do_not_count_in_the_rate(capsys, monkeypatch):
    """Four pieces of work end at 1, 3, 6 and 9 s by a planted clock; the first was stored before ("kept").

    After it each takes 3 s, 20 a minute, whether it is done or fails: 6 s are left for two.
    """
    times = iter([0.0, 1.0, 3.0, 6.0, 9.0])
    monkeypatch.setattr("replay.cli.console.time.monotonic", lambda: next(times))
    report_end = progress_counter(People(), 4)
    for name, outcome in {"a": "kept", "b": "done", "c": "it broke", "d": "done"}.items():
        report_end(name, outcome)
    assert capsys.readouterr().err.splitlines() == [
        "   1 of 4  a: kept",
        "   2 of 4  b: done, about 6 s left at 20 a minute",
        "   3 of 4  c: it broke, about 3 s left at 20 a minute",
        "   4 of 4  d: done",
    ]
