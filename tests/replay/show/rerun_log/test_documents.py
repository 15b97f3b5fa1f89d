from support.report_states import price_row, traded
from support.small_worlds import MEET_IN_4_AND_8_TO_10, unit_cubes_on_x

from replay.engine import compute
from replay.show.rerun_log.documents import dots_of, replayed_sentence


def test_setting_is_plotted_at_its_mean_time_and_loss():
    """Milliseconds a frame, and the loss of a row of the tradeoff, which stands in its name with two digits."""
    slow, quick = price_row("slow", ms=0.5, missed=(0, 1), late=1), price_row("quick", ms=0.05, missed=2, late=3)
    dots = [dot for dot, _ in dots_of(traded(slow, quick))]
    assert [(dot.x, dot.y) for dot in dots] == [(0.5, slow["loss"]), (0.05, quick["loss"])]
    assert [dot.name for dot in dots] == ["slow: 0.083", "quick: 0.28"]


def test_replayed_sentence_states_the_length_of_the_window():
    """Twelve frames at 10 Hz end at 1.1 s; frames 5 to 11 are replayed."""
    run = compute(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10, step_ns=10**8), detectors=(), start=0.5)
    assert replayed_sentence(run).startswith("600 ms, 7 frames")
