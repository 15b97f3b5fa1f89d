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
    ticks_of,
)
from replay.show.report.charts import lane, path_of


@pytest.mark.parametrize("seed", range(5))
def test_labels_of_a_scatter_plot_do_not_overlap(seed):
    """Six random dots; a label of a dot overlaps no other label."""
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
    """From 0.01 to 1000, each once."""
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
    """The lines of a label have all its text and no letter beside the plot; labels and dots alternate downwards."""
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
    (*_, last_line_of_first), (first_line_of_second, *_) = lines
    first_dot, second_dot = plot.dots
    height_of = lambda item: item.at[1]  # noqa: E731
    assert height_of(last_line_of_first) < height_of(first_dot) < height_of(first_line_of_second)
    assert height_of(first_line_of_second) < height_of(second_dot) < plot.size[1]


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


def test_interval_plot_positions_marks_by_value_and_row():
    """An axis from 2 to 6 on 8 to 392 of 400 units, 96 each; rows of 42 units, a second line of a name 15."""
    rows = [
        IntervalRow("a", value=3.0, lower=2.5, upper=5.0, label="3"),
        IntervalRow("x" * 60, value=4.0, lower=2.0, upper=6.0, label="4", kind="missed"),
    ]
    plot = interval_plot(rows, "", "ms", marked_values=(5.0,), start=2.0, end=6.0)
    assert plot.size == (400.0, 42.0 * 2 + 15.0 + 40.0)
    grid = [corners for kind, corners in plot.lines if kind == "grid"]
    assert grid == [[(8.0 + 96.0 * k, 4.0), (8.0 + 96.0 * k, 103.0)] for k in range(5)]
    assert [dot.at for dot in plot.dots] == [(104.0, 30.0), (200.0, 42.0 + 15.0 + 30.0)]
    assert dict(plot.lines)["whisker"] == [(56.0, 30.0), (296.0, 30.0)]
    assert dict(plot.lines)["whisker missed"] == [(8.0, 87.0), (392.0, 87.0)]
    ends = [corners for kind, corners in plot.lines if kind == "end"]
    assert ends == [[(296.0, y - 8.0), (296.0, y + 8.0)] for y in (30.0, 87.0)]
    labels = {(label.text, label.side): label.at for label in plot.labels}
    assert labels["3", "end"] == (392.0, 19.0) and labels["4", "end"] == (392.0, 42.0 + 19.0)
    assert labels["2", "start"] == (8.0, 118.0) and labels["6", "end"] == (392.0, 118.0)
    assert labels["4", "middle"] == (200.0, 118.0) and labels["ms", "end"] == (392.0, 134.0)
    assert [label.at for label in plot.labels if label.dot == 1] == [(8.0, 61.0), (8.0, 76.0)]


def test_name_of_an_interval_ends_two_characters_before_its_figure():
    """384 units are 53 letters; a figure of three leaves 48 for a name."""
    for length, lines in ((48, 1), (49, 2)):
        row = IntervalRow("x" * length, value=0.5, lower=0.0, upper=1.0, label="0.5")
        assert [label.dot for label in interval_plot([row], "", "").labels].count(0) == lines


@pytest.mark.parametrize(
    ("lower", "upper", "has_line"), [(0.0, 1.0, True), (-np.inf, 1.0, False), (0.0, np.inf, False)]
)
def test_interval_without_a_finite_end_is_a_dot(lower, upper, has_line):
    """A whisker is the line from end to end; the dot of the value is there in any case."""
    plot = interval_plot([IntervalRow("a", value=0.5, lower=lower, upper=upper, label="0.5")], "", "", start=0.0)
    assert [kind for kind, _ in plot.lines if kind.startswith("whisker")] == ["whisker"] * has_line
    assert len(plot.dots) == 1


FIELD = {"left": 34.0, "right": 414.0, "top": 22.0, "bottom": 142.0}
"""Between the axes of a plot of 432 by 180."""


@pytest.mark.parametrize(
    ("name", "x", "y", "at", "side"),
    [
        ("ab", 5.0, 5.0, (224.0 + 10.0, 82.0 - 8.0 + 12.0), "start"),
        ("ab", 10.0, 5.0, (414.0 - 10.0, 82.0 - 8.0 + 12.0), "end"),
        ("a" * 24, 5.0, 5.0, (224.0 - 8.9 * 12.0, 82.0 - 24.0 + 12.0), "start"),
        ("a" * 30, 2.5, 5.0, (129.0 + 10.0, 82.0 - 8.0 + 12.0), "start"),
    ],
    ids=["beside it", "on its other side", "above it", "beside it, though long"],
)
def test_name_stands_at_the_first_free_side_of_its_dot(name, x, y, at, side):
    """Small bold letters are 8.9 wide; a line of 15 has its base 12 below its top."""
    plot = scatter([Dot(name, x, y), Dot("", 10.0, 0.0)], "", x_title="ms", y_axis=Axis("loss", [0, 5, 10]))
    width, height = FIELD["right"] - FIELD["left"], FIELD["bottom"] - FIELD["top"]
    dot = FIELD["left"] + width * x / 10.0, FIELD["bottom"] - height * y / 10.0
    assert plot.dots[0].at == pytest.approx(dot)
    (label,) = [label for label in plot.labels if label.text == name]
    assert label.at == pytest.approx(at) and label.side == side


def test_ticks_and_titles_stand_beside_the_field():
    """In units of the picture; the field is from (34, 22) to (414, 142)."""
    plot = scatter([Dot("", 10.0, 10.0)], "", x_title="ms", y_axis=Axis("loss", [0, 5, 10]))
    labels = {(label.text, label.side): label.at for label in plot.labels}
    assert labels["loss", "start"] == (34.0, 11.0) and labels["ms", "end"] == (414.0, 142.0 + 34.0)
    assert labels["5", "end"] == (27.0, 82.0 + 4.0) and labels["10", "middle"] == (414.0, 142.0 + 17.0)


@pytest.mark.parametrize(
    ("largest", "most", "smallest", "ticks"),
    [
        (10.0, 5, 0.0, [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]),
        (9.0, 3, 0.0, [0.0, 5.0, 10.0]),
        (6.0, 5, 2.0, [2.0, 3.0, 4.0, 5.0, 6.0]),
        (0.7, 5, -0.7, [-1.0, -0.5, 0.0, 0.5, 1.0]),
        (101.0, 5, 0.0, [0.0, 25.0, 50.0, 75.0, 100.0, 125.0]),
    ],
)
def test_ticks_are_round_and_enclose_the_values(largest, most, smallest, ticks):
    """``most``: number of steps; a tick stands at 1, 2, 2.5 or 5 times a power of ten."""
    assert ticks_of(largest, most, smallest) == pytest.approx(ticks)


def test_value_on_a_logarithmic_axis_stands_at_its_power():
    """Five decades from 0.01 to 1000: 1 is two of them from the begin."""
    axis = Axis.of("ms", [0.01, 1000.0], 5)
    assert [axis.fraction(value) for value in (0.01, 1.0, 1000.0)] == pytest.approx([0.0, 0.4, 1.0])


def test_equal_values_have_an_axis_of_their_own():
    """A curve of one value lies on the lower axis, an interval of one value at the axis' begin, 8 units."""
    level = curve([(0.0, 20.0), (1.0, 20.0)], (), "", "s", "degC", lowest=20.0)
    heights = {height for _, height in dict(level.lines)["curve"]}
    assert heights == {FIELD["bottom"]}
    row = IntervalRow("a", value=1.0, lower=1.0, upper=1.0, label="1")
    assert interval_plot([row], "", "ms").dots[0].at[0] == pytest.approx(8.0)


def test_wide_and_non_ascii_characters_count_as_widest():
    """M and ä are 15.8 units wide, a 8.9, the full stop 5.7 and A 10.9."""
    assert text_width("M\u00e4a.A") == pytest.approx(15.8 + 15.8 + 8.9 + 5.7 + 10.9)


def label_among(*offsets, centre=(224.0, 82.0)):
    """Position of the name ``abc`` from its dot, in units right and down, with nameless dots at these places."""
    corners = [(FIELD["right"], FIELD["bottom"])] * 6  # more than five names are placed in their order
    points = [centre, *(np.add(centre, offset) for offset in offsets), *corners]
    dots = [
        Dot("" if number else "abc", 10.0 * (x - FIELD["left"]) / 380.0, 10.0 * (FIELD["bottom"] - y) / 120.0)
        for number, (x, y) in enumerate(points)
    ]
    plot = scatter(dots, "", x_title="ms", y_axis=Axis("loss", [0, 5, 10]))
    (label,) = [label for label in plot.labels if label.text == "abc"]
    left = label.at[0] - {"start": 0.0, "end": text_width("abc")}[label.side]
    return pytest.approx((left - centre[0], label.at[1] - 12.0 - centre[1]), abs=1e-6)


BESIDE, OTHER_SIDE = (10.0, -8.0), (-10.0 - 26.7, -8.0)
"""Upper left corner of the name, 26.7 wide and 15 high, right and left of its dot."""


@pytest.mark.parametrize(
    ("offset", "side"),
    [
        ((10.0 + 26.7 + 5.5, 0.0), OTHER_SIDE),
        ((10.0 + 26.7 + 6.5, 0.0), BESIDE),
        ((10.0 - 5.5, 0.0), OTHER_SIDE),
        ((10.0 - 6.5, 0.0), BESIDE),
        ((20.0, -8.0 - 5.5), OTHER_SIDE),
        ((20.0, -8.0 - 6.5), BESIDE),
        ((20.0, 7.0 + 5.5), OTHER_SIDE),
        ((20.0, 7.0 + 6.5), BESIDE),
    ],
)
def test_name_keeps_6_units_from_the_middle_of_other_dots(offset, side):
    """``offset``: of another dot, 5.5 or 6.5 units from the name on any of its four sides."""
    assert label_among(offset) == side


BELOW_BOTH_SIDES = ((20.0, 10.0), (-20.0, 10.0))
"""Dots that reach into the places beside the dot, but not into higher ones."""


@pytest.mark.parametrize(
    ("offsets", "side"),
    [
        (BELOW_BOTH_SIDES, (-26.7 / 2, -24.0)),
        ((*BELOW_BOTH_SIDES, (-2.5, -20.0)), (6.0, -22.0)),
        ((*BELOW_BOTH_SIDES, (2.5, -20.0)), (-4.0 - 26.7, -22.0)),
        ((*BELOW_BOTH_SIDES, (2.5, -20.0), (-2.5, -20.0)), (10.0, -13.0)),
        ((*BELOW_BOTH_SIDES, (2.5, -20.0), (-2.5, -20.0), (20.0, 0.0)), (-10.0 - 26.7, -13.0)),
    ],
    ids=["above", "above right", "above left", "a little higher", "a little higher, on the left"],
)
def test_name_moves_up_where_dots_stand_beside(offsets, side):
    """``offsets``: of other dots; ``side``: of the name's corner, units right of and below its own dot."""
    assert label_among(*offsets) == side


@pytest.mark.parametrize(
    ("x", "height", "side"),
    [(178.0, 0.0, OTHER_SIDE), (147.3, 0.0, (-26.7 / 2, -24.0)), (178.0, 2.5, BESIDE)],
    ids=["right part of a tick", "left part of a tick, another tick on its left", "a little above the ticks"],
)
def test_name_of_a_dot_on_the_floor_avoids_ticks(x, height, side):
    """Tick 4 stands at 186 and tick 2 at 110, each 8.9 wide; their top is 5 below the floor."""
    assert label_among(centre=(x, FIELD["bottom"] - height)) == side
