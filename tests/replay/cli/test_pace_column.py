from replay.cli.pace_column import pace


def test_a_running_stage_says_its_rate_and_the_time_left():
    assert pace(12345.6, 3.4, 1.0, False, "frames") == "12,346 frames/s, 3 s left"


def test_a_stage_that_is_done_or_has_no_rate_says_the_time_it_took():
    assert pace(12345.6, 0.0, 4.06, True, "frames") == "4.1 s"
    assert pace(None, None, 2.0, False, "frames") == "2.0 s"
    assert pace(None, None, None, False, "frames") == ""
