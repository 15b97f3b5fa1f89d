"""Plots: no two names on one another, and a curve goes through its points."""

from itertools import combinations

import numpy as np
import pytest

from replay.show.plots import (
    LETTER_WIDTH,
    LINE_HEIGHT,
    Axis,
    Dot,
    IntervalRow,
    curve,
    interval_plot,
    scatter,
    text_width,
)
from replay.show.report.charts import lane, path_of


@pytest.mark.parametrize("seed", range(5))
def test_labels_of_a_scatter_plot_do_not_overlap(seed):
    random = np.random.default_rng(seed)
    dots = [Dot(f"detector {k}", float(x), float(y)) for k, (x, y) in enumerate(random.uniform(0.1, 9.0, (6, 2)))]
    plot = scatter(dots, alternative_text="", x_title="ms", y_axis=Axis("wrong", [0, 5, 10]))
    boxes = []
    for text in plot.labels:
        wide = text_width(text.text)
        boxes.append(
            (text.at[0] - {"start": 0, "middle": wide / 2, "end": wide}[text.side], wide, text.at[1], text.dot)
        )
    assert sum(dot >= 0 for *_, dot in boxes) == len(dots)
    for (x, wide, y, dot), (other, broad, below, _) in combinations(boxes, 2):
        assert dot < 0 or x + wide <= other or other + broad <= x or abs(y - below) >= LINE_HEIGHT


def test_logarithmic_axis_has_powers_of_ten_and_ends_at_maximum():
    assert Axis.of("ms", [0.01, 1000.0], 5).ticks == pytest.approx([0.01, 0.1, 1.0, 10.0, 100.0, 1000.0])


def test_plotted_step_is_drawn_as_two_level_lines():
    """A minute at 90 Hz, from 20 to 24 degC at frame 4,000: four corners are left."""
    points = [(k / 90, 20.0 if k < 4000 else 24.0) for k in range(5400)]
    plot = curve([(0.0, 20.0), *points[3990:]], (), "words", "s", "degC", 20.0)
    path = path_of(dict(plot.lines)["curve"])
    heights = [float(corner.split()[1]) for corner in path.split("L")]
    assert len(heights) == 4 and heights[0] == heights[1] > heights[2] == heights[3]


def test_lane_draws_intervals_in_its_window_and_lines_for_short():
    """Paths in seconds from the window's start at 10 s: what begins at 9 s is cut; 0.02 s get a line too."""
    drawn = lane(
        {"missed": [(12.0, 12.02), (9.0, 11.0)], "false": [(30.0, 31.0)]}, (10.0, 20.0), "rod", marked_second=15.0
    )
    boxes = "M0.000 0H1.000V20H0.000ZM2.000 0H2.020V20H2.000Z"
    assert drawn.length == 10.0
    assert drawn.paths == [("missed", boxes), ("missed tick", "M2.010 0V20"), ("now", "M5.000 0V20")]


def test_long_label_of_an_interval_plot_is_wrapped_unshortened():
    names = ["ease of use with unintended contacts per minute: exact" * 2, "short"]
    rows = [IntervalRow(name, value=0.5, lower=0.0, upper=1.0, label="+0.50, n = 24") for name in names]
    plot = interval_plot(rows, "Results.", "coefficient", title="By detector")
    assert plot.title == "By detector"
    lines = [[label for label in plot.labels if label.dot == number] for number in range(2)]
    assert ["".join(label.text.replace(" ", "") for label in own) for own in lines] == [
        name.replace(" ", "") for name in names
    ]
    heights = [label.at[1] for own in lines for label in own]
    assert len(lines[0]) > 1 and heights == sorted(set(heights))
    assert all(label.at[0] + LETTER_WIDTH * len(label.text) <= plot.size[0] for own in lines for label in own)
    assert lines[0][-1].at[1] < plot.dots[0].at[1] < lines[1][0].at[1] < plot.dots[1].at[1] < plot.size[1]


def test_labels_do_not_cover_leader_lines_of_other_dots():
    """Dots of the demo, where the label of the reference has room only above another label."""
    costs = {"exact: 0": (0.019, 0.0), "mesh50: 0.12": (0.033, 0.12), "fix: 0.2": (0.042, 0.2)}
    costs |= {"paper: 0.03": (0.043, 0.03), "hull50: 0.9": (0.018, 0.9)}
    dots = [Dot(name, x, y) for name, (x, y) in costs.items()]
    plot = scatter(dots, alternative_text="", x_title="mean ms a frame", y_axis=Axis("loss", [0, 0.5, 1]))
    leaders = [corners for kind, corners in plot.lines if kind == "leader"]
    assert leaders and len(plot.labels) >= len(dots)
    for label in plot.labels:
        wide = text_width(label.text)
        left = label.at[0] - {"start": 0.0, "middle": wide / 2, "end": wide}[label.side]
        for (x, y), (end, top) in leaders:
            apart = max(x, end) <= left or left + wide <= min(x, end)
            assert apart or max(y, top) <= label.at[1] - LINE_HEIGHT + 3 or label.at[1] + 3 <= min(y, top), label.text
