"""Times of detectors in the picture: stages added up, where plots end, and what the view of losses holds."""

from types import SimpleNamespace

import numpy as np
import pytest
from support.small_worlds import verdict_column

from replay.document.cost import BUDGET_MS
from replay.show.accuracy import accuracy_plot
from replay.show.palette import SERIES_COLOURS, TICKS
from replay.show.plots import LETTER_WIDTH, Dot
from replay.show.rerun_log.recording_file import pack_colours
from replay.show.rerun_log.timing import (
    IDLE_S,
    SCATTER_SIZE,
    TEXT_RISE,
    UNITS_PER_PLOT_UNIT,
    X_RANGE,
    Y_RANGE,
    budget_fraction,
    log_accuracy,
    log_timing,
    plot_cut_ms,
    stage_ms,
)

FRAMES = 3


class SentItems:
    """A writer of a recording of three frames that keeps what is sent to it: path -> content."""

    def __init__(self):
        self.clock = SimpleNamespace(ns=np.arange(FRAMES))
        self.curves, self.drawings = {}, {}

    def curve(self, path, values, name, colour):
        self.curves[path] = (values.tolist(), name)

    def static(self, path, drawing):
        self.drawings[path] = drawing


def timed_detection(**seconds):
    """A detection of three frames with these seconds by stage."""
    return verdict_column("." * FRAMES, seconds=seconds)


def test_stages_of_a_phase_are_added_and_idle_omitted():
    """Two stages of the broad phase; seconds of all frames at once are 1 ms each; ``rest`` takes too little to show."""
    detection = timed_detection(volumes=np.array([1e-3, 2e-3, 0.0]), boxes=3e-3, surfaces=6e-3, rest=IDLE_S * FRAMES)
    stages = {name: milliseconds.tolist() for name, milliseconds in stage_ms(detection).items()}
    assert stages == {"broad phase": pytest.approx([2.0, 3.0, 1.0]), "narrow phase": pytest.approx([2.0] * FRAMES)}


@pytest.mark.parametrize(
    ("totals", "cut"),
    [([], BUDGET_MS), ([np.zeros(0)], BUDGET_MS), ([np.zeros(2)], BUDGET_MS), ([np.zeros(2), np.arange(1001)], 999.0)],
)
def test_plot_of_times_ends_at_the_largest_99_9th_percentile(totals, cut):
    """``totals``: milliseconds of each detector; of 0 to 1000 ms 999 is it, and without times the budget of a frame."""
    assert plot_cut_ms(totals) == pytest.approx(cut)


@pytest.mark.parametrize(("plot_top", "fraction"), [(30.0, 1.0), (1.0, 1.0), (0.9, 0.1), (0.1, 0.1), (0.09, 0.01)])
def test_budget_line_is_a_power_of_ten_within_the_plot(plot_top, fraction):
    """Both figures are fractions of the budget of a frame."""
    assert budget_fraction(plot_top * BUDGET_MS) == pytest.approx(fraction)


def test_sum_of_all_stages_is_drawn_first():
    """Rerun draws entities in the order of their names."""
    sent = SentItems()
    log_timing(sent, {"exact": timed_detection(volumes=3e-3, surfaces=6e-3)}, {"exact": "exact"})
    stages = [curve for path, curve in sorted(sent.curves.items()) if "/stages/" in path]
    assert stages == [(pytest.approx([3.0] * 3), "+ narrow phase"), (pytest.approx([1.0] * 3), "broad phase")]


def test_labels_of_the_loss_plot_have_position_and_colour():
    """Rerun centres a text on its position and hangs it below, so each is moved by half its width and up.

    ``side``: whether the position in the page's plot is the start, the middle or the end of the text. ``dot``: the
    number of the dot that a label names; -1: it is a label of an axis.
    """
    sent, dots = SentItems(), [Dot("slow: 0.5", 0.2, 0.5), Dot("exact: 0", 0.05, 0.0)]
    log_accuracy(sent, list(zip(dots, SERIES_COLOURS, strict=False)))
    drawing = sent.drawings["accuracy/plot/words"]
    colours = drawing.colors.as_arrow_array().to_pylist()
    centres = np.array(drawing.positions.as_arrow_array().to_pylist()) / UNITS_PER_PLOT_UNIT
    title = next(text for text in drawing.labels.as_arrow_array().to_pylist() if text.startswith("loss"))
    labels = accuracy_plot(dots, SCATTER_SIZE, title).labels
    assert {label.dot for label in labels} == {-1, 0, 1} and {"start", "end"} <= {label.side for label in labels}
    for label, colour, (centre_x, centre_y) in zip(labels, colours, centres, strict=True):
        half_width = LETTER_WIDTH * len(label.text) / 2
        edge = {"start": centre_x - half_width, "middle": centre_x, "end": centre_x + half_width}[label.side]
        assert (edge, centre_y) == pytest.approx((label.at[0], label.at[1] - TEXT_RISE / UNITS_PER_PLOT_UNIT), abs=0.01)
        assert [colour] == pack_colours([TICKS if label.dot < 0 else SERIES_COLOURS[label.dot]])


def test_view_of_the_loss_plot_holds_the_whole_plot():
    """The view's range on each axis begins before 0 and ends beyond the plot's length."""
    for (lower, upper), length in zip((X_RANGE, Y_RANGE), SCATTER_SIZE, strict=True):
        assert lower < 0.0 < UNITS_PER_PLOT_UNIT * length < upper
