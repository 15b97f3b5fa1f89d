from replay.cli.console import People, counting, pace, stdout_console


def test_people_are_spoken_to_on_stderr_unless_quiet(capsys):
    People().say("hello")
    People(quiet=True).say("nothing")
    People().detail("nothing")
    People(verbose=True).detail("more")
    out, err = capsys.readouterr()
    assert (out, err) == ("", "hello\nmore\n")


def test_a_broken_gate_is_named_to_the_quiet_too(capsys):
    assert People(quiet=True).gate([]) == 0 and People(quiet=True).gate(["it missed 1"]) == 4
    assert capsys.readouterr().err == "gate: it missed 1\n"


def test_tables_lose_nothing_where_there_is_no_terminal(capsys):
    stdout_console().print("x" * 159)
    assert capsys.readouterr().out == "x" * 159 + "\n"


def test_a_running_stage_says_its_rate_and_the_time_left():
    assert pace(12345.6, 3.4, 1.0, False, "frames") == "12,346 frames/s, 3 s left"


def test_a_stage_that_is_done_or_has_no_rate_says_the_time_it_took():
    assert pace(12345.6, 0.0, 4.06, True, "frames") == "4.1 s"
    assert pace(None, None, 2.0, False, "frames") == "2.0 s"
    assert pace(None, None, None, False, "frames") == ""


def test_pieces_are_counted_with_rate_and_time_left_and_those_there_before_count_for_neither(capsys, monkeypatch):
    times = iter([0.0, 1.0, 3.0, 6.0, 9.0])
    monkeypatch.setattr("replay.cli.console.time.monotonic", lambda: next(times))
    tell = counting(People(), 4)
    for name, became in {"a": "kept", "b": "done", "c": "it broke", "d": "done"}.items():
        tell(name, became)
    assert capsys.readouterr().err.splitlines() == [
        "   1 of 4  a: kept",
        "   2 of 4  b: done, about 6 s left at 20 a minute",
        "   3 of 4  c: it broke, about 3 s left at 20 a minute",
        "   4 of 4  d: done",
    ]
