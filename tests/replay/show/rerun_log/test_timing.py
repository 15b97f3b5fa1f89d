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
"""Of each detection of this file."""


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
    """Three frames. ``volumes`` (seconds a frame) and ``boxes`` (3 ms for all frames) are stages of the broad phase.

    ``surfaces`` is the narrow phase, 6 ms for all frames; ``rest`` takes so little (``IDLE_S`` a frame) that it is left
    out.
    """
    detection = timed_detection(volumes=np.array([1e-3, 2e-3, 0.0]), boxes=3e-3, surfaces=6e-3, rest=IDLE_S * FRAMES)
    phases = {name: milliseconds.tolist() for name, milliseconds in stage_ms(detection).items()}
    assert phases == {
        "broad phase": pytest.approx([1.0 + 1.0, 2.0 + 1.0, 0.0 + 1.0]),
        "narrow phase": pytest.approx([2.0, 2.0, 2.0]),
    }


def test_plot_of_times_ends_at_the_largest_99_9th_percentile():
    """``totals``: milliseconds of each frame, of each detector. 999 of the 1000 steps from 0 to 1000 ms end at 999 ms.

    Without times the plot ends at the budget of a frame.
    """
    rows = {
        "no detector": ([], BUDGET_MS),
        "no frame": ([np.zeros(0)], BUDGET_MS),
        "no time": ([np.zeros(2)], BUDGET_MS),
        "0 to 1000 ms": ([np.zeros(2), np.arange(1001)], 999.0),
    }
    for row, (totals, cut_ms) in rows.items():
        assert plot_cut_ms(totals) == pytest.approx(cut_ms), row


def test_budget_line_is_a_power_of_ten_within_the_plot():
    """A line is at the budget of a frame, or at a tenth, a hundredth ... of it, the largest that the plot reaches.

    ``plot_top``: where the plot ends; both are multiples of the budget.
    """
    for plot_top, fraction in ((30.0, 1.0), (1.0, 1.0), (0.9, 0.1), (0.1, 0.1), (0.09, 0.01)):
        assert budget_fraction(plot_top * BUDGET_MS) == pytest.approx(fraction), plot_top


def test_sum_of_all_stages_is_drawn_first():
    """3 ms of the broad phase and 6 ms of the narrow one for three frames: 1 and 2 ms a frame.

    Curves are stacked: the broad phase alone (1 ms), and both (3 ms) behind it. Rerun draws entities in the order of
    their paths, so the sum has the first.
    """
    sent = SentItems()
    log_timing(sent, {"exact": timed_detection(volumes=3e-3, surfaces=6e-3)}, {"exact": "exact"})
    curves = [curve for path, curve in sorted(sent.curves.items()) if "/stages/" in path]
    assert curves == [(pytest.approx([3.0] * FRAMES), "+ narrow phase"), (pytest.approx([1.0] * FRAMES), "broad phase")]


@pytest.fixture
def labels_of_loss_plot():
    """Labels of the plot of losses of two detectors, each as the page places it and as the picture draws it."""
    sent, dots = SentItems(), [Dot("slow: 0.5", x=0.2, y=0.5), Dot("exact: 0", x=0.05, y=0.0)]
    log_accuracy(sent, list(zip(dots, SERIES_COLOURS[:2], strict=True)))
    drawing = sent.drawings["accuracy/plot/words"]
    texts = drawing.labels.as_arrow_array().to_pylist()
    colours = drawing.colors.as_arrow_array().to_pylist()
    centres = np.array(drawing.positions.as_arrow_array().to_pylist()) / UNITS_PER_PLOT_UNIT
    title = next(text for text in texts if text.startswith("loss"))
    labels = accuracy_plot(dots, SCATTER_SIZE, title).labels
    return [*zip(labels, texts, colours, centres, strict=True)]


def test_labels_of_the_loss_plot_stand_as_in_the_page(labels_of_loss_plot):
    """The page places the start, middle or end (``side``) of a text; Rerun centres a text on its position.

    Rerun also hangs a text below its position, so each is moved up by ``TEXT_RISE``.
    """
    assert {label.side for label, *_ in labels_of_loss_plot} >= {"start", "end"}
    for label, _text, _colour, (centre_x, centre_y) in labels_of_loss_plot:
        half_width = LETTER_WIDTH * len(label.text) / 2
        x = {"start": centre_x - half_width, "middle": centre_x, "end": centre_x + half_width}[label.side]
        expected_x, base = label.at
        assert (x, centre_y) == pytest.approx((expected_x, base - TEXT_RISE / UNITS_PER_PLOT_UNIT), abs=0.01)


def test_labels_of_the_loss_plot_have_their_dots_colour(labels_of_loss_plot):
    """``dot``: number of the detector that a label names, of two; -1: it is a label of an axis, in a colour for all."""
    assert {label.dot for label, *_ in labels_of_loss_plot} == {-1, 0, 1}
    for label, text, colour, _centre in labels_of_loss_plot:
        expected_colour = TICKS if label.dot == -1 else SERIES_COLOURS[label.dot]
        assert text == label.text
        assert [colour] == pack_colours([expected_colour])


def test_view_of_the_loss_plot_holds_the_whole_plot():
    """The view's range on both axes begins before the plot, at 0, and ends beyond its width and its height."""
    for (begin, end), plot_length in zip((X_RANGE, Y_RANGE), SCATTER_SIZE, strict=True):
        assert begin < 0.0
        assert UNITS_PER_PLOT_UNIT * plot_length < end
