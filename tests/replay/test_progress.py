from replay.progress import Silent


def test_silence_takes_any_stage_and_any_advance():
    with Silent().stage("detect", 10) as advance:
        assert advance(3) is None
