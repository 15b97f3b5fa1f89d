from support.price_rows import price_row
from support.report_states import traded
from support.small_worlds import TWO_BUMPS, cubes

from replay.outputs.rerun_log.documents import dots_of, replayed
from replay.pipeline.engine import compute


def test_a_setting_stands_at_its_time_and_at_what_it_misses_or_finds_in_part():
    slow, quick = price_row("slow", 0.5, (0, 1), 1) | {"false": None}, price_row("quick", 0.05, 2, 3) | {"false": 0.25}
    dots = dots_of(traded(slow, quick))
    assert [(dot.x, dot.y, false) for dot, false, _ in dots] == [(0.05, 5.0, 0.25), (0.5, 1.5, 0.0)]
    assert [dot.name for dot, *_ in dots] == ["quick: 5", "slow: 1.5"]


def test_what_was_replayed_is_as_long_as_its_window():
    run = compute(cubes(TWO_BUMPS, step_ns=10**8), detectors=(), start=0.5)
    assert replayed(run).startswith("0.6 s, 7 frames")
