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


def box_of_label(label):
    """Left, top, right and bottom of a text of one line, which is 15 high and reaches 3 below its base line."""
    width = text_width(label.text)
    x, base = label.at
    left = x - {"start": 0.0, "middle": width / 2, "end": width}[label.side]
    return left, base + 3.0 - LINE_HEIGHT, left + width, base + 3.0


def boxes_overlap(first, second):
    """Whether two boxes (left, top, right, bottom) have a common area."""
    return first[0] < second[2] and second[0] < first[2] and first[1] < second[3] and second[1] < first[3]


def test_labels_of_a_scatter_plot_do_not_overlap():
    """Six dots at random places, five times, each dot with its name.

    Names overlap neither each other nor numbers of the axes. A label names the dot of its number ``dot``; -1: it
    belongs to an axis.
    """
    for seed in range(5):
        points = np.random.default_rng(seed).uniform(0.1, 9.0, (6, 2)).tolist()
        dots = [Dot(f"detector {number}", x=x, y=y) for number, (x, y) in enumerate(points)]
        plot = scatter(dots, alternative_text="", x_title="ms", y_axis=Axis("wrong", [0, 5, 10]))
        assert sorted(label.dot for label in plot.labels if label.dot >= 0) == [0, 1, 2, 3, 4, 5], seed
        for first, second in combinations(plot.labels, 2):
            if first.dot >= 0 or second.dot >= 0:
                assert not boxes_overlap(box_of_label(first), box_of_label(second)), seed


def test_logarithmic_axis_has_powers_of_ten_and_ends_at_maximum():
    """Values of 0.01 and 1000 ms are too far apart (over 30 times) for a linear axis."""
    axis = Axis.of("ms", [0.01, 1000.0], most_ticks=5)
    assert axis.ticks == pytest.approx([0.01, 0.1, 1.0, 10.0, 100.0, 1000.0])


def test_plotted_step_is_drawn_as_two_level_lines():
    """A temperature at 90 Hz rises from 20 to 24 degC between frames 3999 and 4000: 1,400 points in two levels.

    Four corners are left of the path, begin and end of each level; pixels count downwards, so 24 degC is the smaller.
    """
    rise = 4000
    points = [(frame / 90, 20.0 if frame < rise else 24.0) for frame in range(5400)]
    levels = [(0.0, 20.0), *points[rise - 10 :]]
    plot = curve(levels, end_points=(), alternative_text="", x_title="s", y_title="degC", lowest=20.0)
    path = path_of(dict(plot.lines)["curve"])
    heights = [float(corner.split()[1]) for corner in path.split("L")]
    assert len(heights) == 4
    assert heights[0] == heights[1] > heights[2] == heights[3]


def test_lane_draws_intervals_in_its_window_and_lines_for_short():
    """A lane from 10 to 20 s, drawn as SVG paths: x in seconds since 10 s, y from 0 to 20.

    Missed from 9 to 11 s is cut at the begin; missed for 0.02 s gets a line in its middle too; false at 30 s is
    outside; a line marks 15 s.
    """
    intervals = {"missed": [(12.0, 12.02), (9.0, 11.0)], "false": [(30.0, 31.0)]}
    drawn = lane(intervals, (10.0, 20.0), "rod", marked_second=15.0)
    box_from_0_to_1, box_from_2_to_2_02 = "M0.000 0H1.000V20H0.000Z", "M2.000 0H2.020V20H2.000Z"
    assert drawn.length == 10.0
    assert drawn.paths == [
        ("missed", box_from_0_to_1 + box_from_2_to_2_02),
        ("missed tick", "M2.010 0V20"),
        ("now", "M5.000 0V20"),
    ]


LONG_AND_SHORT_NAME = ["ease of use with unintended contacts per minute: exact" * 2, "short"]


@pytest.fixture
def plot_with_long_name():
    """A plot of two intervals below each other; the name of the first is longer than the plot is wide."""
    rows = [IntervalRow(name, value=0.5, lower=0.0, upper=1.0, label="+0.50, n = 24") for name in LONG_AND_SHORT_NAME]
    return interval_plot(rows, "Results.", "coefficient", title="By detector")


def test_long_label_of_an_interval_plot_is_wrapped_unshortened(plot_with_long_name):
    """The name of the first of two rows takes several lines, which have all its letters and end within the plot."""
    plot = plot_with_long_name
    lines_of_row = [[label for label in plot.labels if label.dot == row] for row in (0, 1)]
    texts = ["".join(label.text for label in lines).replace(" ", "") for lines in lines_of_row]
    assert texts == [name.replace(" ", "") for name in LONG_AND_SHORT_NAME]
    assert [len(lines) > 1 for lines in lines_of_row] == [True, False]
    width, _height = plot.size
    for label in (*lines_of_row[0], *lines_of_row[1]):
        x, _y = label.at
        assert x + LETTER_WIDTH * len(label.text) <= width


def test_names_and_dots_of_an_interval_plot_alternate_downwards(plot_with_long_name):
    """Two rows: the lines of the first name, its dot, the second name, its dot, then the lower end of the plot.

    y counts downwards. The title that the plot was made with stays with it.
    """
    plot = plot_with_long_name
    assert plot.title == "By detector"
    first_name, second_name = ([label.at[1] for label in plot.labels if label.dot == row] for row in (0, 1))
    first_dot, second_dot = (dot.at[1] for dot in plot.dots)
    _width, height = plot.size
    downwards = [*first_name, first_dot, *second_name, second_dot, height]
    assert downwards == sorted(set(downwards))


def test_labels_do_not_cover_leader_lines_of_other_dots():
    """Dots of a real run, so near each other that a name finds room only away from its dot, with a leader line to it.

    No label of a dot or an axis overlaps a leader line, taken as the box between its ends.
    """
    cost_and_loss = {"exact: 0": (0.019, 0.0), "mesh50: 0.12": (0.033, 0.12), "fix: 0.2": (0.042, 0.2)}
    cost_and_loss |= {"paper: 0.03": (0.043, 0.03), "hull50: 0.9": (0.018, 0.9)}
    dots = [Dot(name, x=cost, y=loss) for name, (cost, loss) in cost_and_loss.items()]
    plot = scatter(dots, alternative_text="", x_title="mean ms a frame", y_axis=Axis("loss", [0, 0.5, 1]))
    leaders = [ends for kind, ends in plot.lines if kind == "leader"]
    assert leaders
    assert {label.text for label in plot.labels} >= set(cost_and_loss)
    for label in plot.labels:
        for (x, y), (end_x, end_y) in leaders:
            leader_box = min(x, end_x), min(y, end_y), max(x, end_x), max(y, end_y)
            assert not boxes_overlap(box_of_label(label), leader_box), label.text


@pytest.fixture
def plot_of_two_intervals():
    """A plot of 400 units width, y downwards; its axis from 2 to 6 lies on 8 to 392, so a unit of it is 96 wide.

    Row "a" is 42 high with its marks at 30. The name of the second row takes two lines, the second 15 high: its marks
    are at 42 + 15 + 30 = 87. The axis is at 42 + 42 + 15 + 4 = 103.
    """
    rows = [
        IntervalRow("a", value=3.0, lower=2.5, upper=5.0, label="3"),
        IntervalRow("x" * 60, value=4.0, lower=2.0, upper=6.0, label="4", kind="missed"),
    ]
    return interval_plot(rows, "", "ms", marked_values=(5.0,), start=2.0, end=6.0)


def test_interval_plot_positions_marks_by_value_and_row(plot_of_two_intervals):
    """The axis from 2 to 6 begins at x = 8, 96 units each; rows "a" (3, from 2.5 to 5) and "xx..." (4, from 2 to 6).

    Marks of the rows are at y = 30 and 87; the second row is of the kind "missed", which its whisker is called by. The
    marked value 5 is a line of the kind "end" in each row, from 8 above to 8 below its mark.
    """
    plot = plot_of_two_intervals
    x_of_value = {value: 8.0 + 96.0 * (value - 2.0) for value in (2.0, 2.5, 3.0, 4.0, 5.0, 6.0)}
    assert [dot.at for dot in plot.dots] == [(x_of_value[3.0], 30.0), (x_of_value[4.0], 87.0)]
    whiskers = {kind: ends for kind, ends in plot.lines if kind.startswith("whisker")}
    assert whiskers == {
        "whisker": [(x_of_value[2.5], 30.0), (x_of_value[5.0], 30.0)],
        "whisker missed": [(x_of_value[2.0], 87.0), (x_of_value[6.0], 87.0)],
    }
    marks_at_5 = [ends for kind, ends in plot.lines if kind == "end"]
    assert marks_at_5 == [[(x_of_value[5.0], y - 8.0), (x_of_value[5.0], y + 8.0)] for y in (30.0, 87.0)]


def test_interval_plot_has_a_grid_line_at_each_tick(plot_of_two_intervals):
    """Ticks 2 to 6 at x = 8, 104, ... 392; lines from y = 4 down to the axis at 103.

    The plot is as high as its two rows of 42, a second line of a name of 15, and 40 for the axis.
    """
    grid = [ends for kind, ends in plot_of_two_intervals.lines if kind == "grid"]
    assert grid == [[(x, 4.0), (x, 103.0)] for x in (8.0, 104.0, 200.0, 296.0, 392.0)]
    assert plot_of_two_intervals.size == (400.0, 42.0 + 42.0 + 15.0 + 40.0)


def test_texts_of_an_interval_plot_stand_at_row_and_axis(plot_of_two_intervals):
    """Figures at the right end (392), names at the left (8), 19 below the top of their row, the next line 15 lower.

    The second row begins at 42. Numbers of the axis are 15 below it (103), its unit 31 below; those at both ends of
    the axis do not reach beyond it.
    """
    labels = plot_of_two_intervals.labels
    position_of = {(label.text, label.side): label.at for label in labels}
    assert position_of["3", "end"] == (392.0, 19.0)
    assert position_of["4", "end"] == (392.0, 42.0 + 19.0)
    assert [label.at for label in labels if label.dot == 1] == [(8.0, 42.0 + 19.0), (8.0, 42.0 + 19.0 + 15.0)]
    assert position_of["2", "start"] == (8.0, 103.0 + 15.0)
    assert position_of["4", "middle"] == (200.0, 103.0 + 15.0)
    assert position_of["6", "end"] == (392.0, 103.0 + 15.0)
    assert position_of["ms", "end"] == (392.0, 103.0 + 31.0)


@pytest.mark.parametrize(
    ("length", "lines"), [pytest.param(48, 1, id="fits"), pytest.param(49, 2, id="a letter too long")]
)
def test_name_of_an_interval_ends_two_characters_before_its_figure(length, lines):
    """A row of 384 units has room for 53 letters of 7.2: a figure of 3, a gap of 2, and a name of 48."""
    row = IntervalRow("x" * length, value=0.5, lower=0.0, upper=1.0, label="0.5")
    lines_of_name = [label.text for label in interval_plot([row], "", "").labels if label.dot == 0]
    assert len(lines_of_name) == lines


def test_interval_without_a_finite_end_is_a_dot():
    """A whisker is the line from end to end, which an infinite interval lacks; the dot of its value is there."""
    rows = {
        "both ends": (0.0, 1.0, 1),
        "no lower end": (-np.inf, 1.0, 0),
        "no upper end": (0.0, np.inf, 0),
    }
    for row, (lower, upper, whiskers) in rows.items():
        plot = interval_plot([IntervalRow("a", value=0.5, lower=lower, upper=upper, label="0.5")], "", "", start=0.0)
        assert [kind for kind, _ in plot.lines if kind.startswith("whisker")] == ["whisker"] * whiskers, row
        assert len(plot.dots) == 1, row


FIELD = {"left": 34.0, "right": 414.0, "bottom": 142.0}
"""Of the field between the axes, 380 by 120, of a plot of 432 by 180."""


def test_name_stands_at_the_first_free_side_of_its_dot():
    """The field of the plot is 380 wide from 34 and 120 high from 22, for values from 0 to 10: 5 is at (224, 82).

    A name begins 10 right of its dot and 8 above; else it ends 10 left of it, or its middle is above, 24 higher.
    Small letters are 8.9 wide, the base of a line is 12 below its top. A second dot, without a name, ends the axis.
    """
    rows = {
        "right of it": ("ab", 5.0, 5.0, 224.0 + 10.0, 82.0 - 8.0 + 12.0, "start"),
        "left of it": ("ab", 10.0, 5.0, 414.0 - 10.0, 82.0 - 8.0 + 12.0, "end"),
        "above it": ("a" * 24, 5.0, 5.0, 224.0 - 8.9 * 12.0, 82.0 - 24.0 + 12.0, "start"),
        "right of it, though long": ("a" * 30, 2.5, 5.0, 129.0 + 10.0, 82.0 - 8.0 + 12.0, "start"),
    }
    for row, (name, x, y, label_x, label_base, side) in rows.items():
        plot = scatter([Dot(name, x=x, y=y), Dot("", x=10.0, y=0.0)], "", x_title="ms", y_axis=Axis("loss", [0, 5, 10]))
        dot = 34.0 + 380.0 * x / 10.0, 22.0 + 120.0 * (1.0 - y / 10.0)
        assert plot.dots[0].at == pytest.approx(dot), row
        (label,) = [label for label in plot.labels if label.text == name]
        assert label.at == pytest.approx((label_x, label_base)), row
        assert label.side == side, row


def test_ticks_and_titles_stand_beside_the_field():
    """The field between the axes is from (34, 22) to (414, 142), y downwards; both axes go from 0 to 10.

    5 is 7 left of the upright axis at half its height, its base line 4 lower; 10 is 17 below the end of the other one.
    """
    plot = scatter([Dot("", x=10.0, y=10.0)], "", x_title="ms", y_axis=Axis("loss", [0, 5, 10]))
    position_of = {(label.text, label.side): label.at for label in plot.labels}
    assert position_of["loss", "start"] == (34.0, 11.0)
    assert position_of["ms", "end"] == (414.0, 142.0 + 34.0)
    assert position_of["5", "end"] == (34.0 - 7.0, 82.0 + 4.0)
    assert position_of["10", "middle"] == (414.0, 142.0 + 17.0)


def test_ticks_are_round_and_enclose_the_values():
    """Steps are 1, 2, 2.5 or 5 times a power of ten, the smallest of which ``most_steps`` span the values.

    The first and the last tick are multiples of the step too, so there may be a step more.
    """
    rows = {
        "10 in 5 steps": (0.0, 10.0, 5, [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]),
        "9 in 3 steps, beyond its end": (0.0, 9.0, 3, [0.0, 5.0, 10.0]),
        "from 2 to 6": (2.0, 6.0, 5, [2.0, 3.0, 4.0, 5.0, 6.0]),
        "around 0": (-0.7, 0.7, 5, [-1.0, -0.5, 0.0, 0.5, 1.0]),
        "101 in steps of 25": (0.0, 101.0, 5, [0.0, 25.0, 50.0, 75.0, 100.0, 125.0]),
    }
    for row, (smallest, largest, most_steps, ticks) in rows.items():
        assert ticks_of(largest, most_steps, smallest) == pytest.approx(ticks), row


def test_value_on_a_logarithmic_axis_stands_at_its_power():
    """Five powers of ten from 0.01 to 1000 ms: 1 is two of them from the begin, 2/5 of the axis."""
    axis = Axis.of("ms", [0.01, 1000.0], most_ticks=5)
    assert [axis.fraction(value) for value in (0.01, 1.0, 1000.0)] == pytest.approx([0.0, 0.4, 1.0])


def test_curve_of_equal_values_lies_on_the_lower_axis():
    """A temperature that stays at 20 degC, where the axis begins: the lower edge of the field, y = 142."""
    plot = curve([(0.0, 20.0), (1.0, 20.0)], (), "", x_title="s", y_title="degC", lowest=20.0)
    heights = {height for _, height in dict(plot.lines)["curve"]}
    assert heights == {142.0}


def test_interval_of_a_single_value_begins_its_axis():
    """A plot of an interval whose value and both ends are 1: the axis begins there, at x = 8 of 400 units."""
    row = IntervalRow("a", value=1.0, lower=1.0, upper=1.0, label="1")
    (dot,) = interval_plot([row], "", "ms").dots
    x, _y = dot.at
    assert x == pytest.approx(8.0)


def test_wide_and_non_ascii_characters_count_as_widest():
    """Bold letters: M and all beyond ASCII (ä) are 15.8 units wide, a is 8.9, the full stop 5.7 and A 10.9."""
    assert text_width("M\u00e4a.A") == pytest.approx(15.8 + 15.8 + 8.9 + 5.7 + 10.9)


def plot_of_names(names_by_offset, dot):
    """A scatter plot of the dot ``abc`` and of others, which stand at these offsets from it, in units right and down.

    Six nameless dots more lie in a corner of the field, so that names are placed in their order (up to five are tried
    in every order).
    """
    points = {dot: "abc"} | {tuple(np.add(dot, offset)): name for offset, name in names_by_offset.items()}
    corner = Dot("", x=10.0, y=0.0)
    dots = [
        Dot(name, x=10.0 * (x - FIELD["left"]) / 380.0, y=10.0 * (FIELD["bottom"] - y) / 120.0)
        for (x, y), name in points.items()
    ]
    return scatter([*dots, *[corner] * 6], "", x_title="ms", y_axis=Axis("loss", [0, 5, 10]))


def offset_of(plot, name, dot):
    """Upper left corner of a name in a plot from a dot, in units right and down."""
    (label,) = [label for label in plot.labels if label.text == name]
    left, top, _right, _bottom = box_of_label(label)
    return pytest.approx((left - dot[0], top - dot[1]), abs=1e-6)


def offset_of_name(other_dots=(), dot=(224.0, 82.0)):
    """Upper left corner of the name ``abc`` from its dot, in units right and down; nameless dots stand around it."""
    return offset_of(plot_of_names(dict.fromkeys(other_dots, ""), dot), "abc", dot)


NAME_WIDTH = 26.7
"""Width of the name ``abc``, three letters of 8.9; it is 15 high."""

RIGHT, LEFT, ABOVE = (10.0, -8.0), (-10.0 - NAME_WIDTH, -8.0), (-NAME_WIDTH / 2, -24.0)
"""Upper left corner of the name from its dot, in units right and down, by where it stands."""


def test_name_keeps_6_units_from_the_middle_of_other_dots():
    """Right of its dot, a name begins 10 right and 8 above it, and is 26.7 wide and 15 high; all as (right, down).

    Another dot (``other_dot``, from the first) nearer than 6 to that place sends the name to the left.
    """
    rows = {
        "5.5 right of the name": ((10.0 + NAME_WIDTH + 5.5, 0.0), LEFT),
        "6.5 right of the name": ((10.0 + NAME_WIDTH + 6.5, 0.0), RIGHT),
        "5.5 left of the name": ((10.0 - 5.5, 0.0), LEFT),
        "6.5 left of the name": ((10.0 - 6.5, 0.0), RIGHT),
        "5.5 above the name": ((20.0, -8.0 - 5.5), LEFT),
        "6.5 above the name": ((20.0, -8.0 - 6.5), RIGHT),
        "5.5 below the name": ((20.0, -8.0 + 15.0 + 5.5), LEFT),
        "6.5 below the name": ((20.0, -8.0 + 15.0 + 6.5), RIGHT),
    }
    for row, (other_dot, corner) in rows.items():
        assert offset_of_name([other_dot]) == corner, row


BELOW_BOTH_SIDES = ((20.0, 10.0), (-20.0, 10.0))
"""Dots that reach into the places right and left of the dot, 8 above to 7 below it, but not into higher ones."""


def test_name_moves_up_where_dots_stand_beside():
    """Two dots 10 below reach into the places right and left of a dot; further ones take the next places of its name.

    Offsets are from the dot, in units right and down; the corner is the upper left one of the name, which is 26.7 wide
    and 15 high and keeps 6 from other dots. Its places are tried in the order of the rows.
    """
    rows = {
        "above": ([], ABOVE),
        "above right": ([(-2.5, -20.0)], (6.0, -22.0)),
        "above left": ([(2.5, -20.0)], (-4.0 - NAME_WIDTH, -22.0)),
        "right, a little higher": ([(2.5, -20.0), (-2.5, -20.0)], (10.0, -13.0)),
        "left, a little higher": ([(2.5, -20.0), (-2.5, -20.0), (20.0, 0.0)], (-10.0 - NAME_WIDTH, -13.0)),
    }
    for row, (higher_dots, corner) in rows.items():
        assert offset_of_name([*BELOW_BOTH_SIDES, *higher_dots]) == corner, row


def test_name_of_a_dot_on_the_floor_avoids_ticks():
    """Numbers of the axis, 2 at x = 110 and 4 at x = 186, are 8.9 wide and begin 5 below the floor of the field.

    A name reaches 7 below its dot and from 10 to 36.7 beside it: into the number 4, or into the number 2 on the left,
    if the dot lies on the floor.
    """
    rows = {
        "number on its right": (178.0, 0.0, LEFT),
        "numbers on both sides": (147.3, 0.0, ABOVE),
        "a little above the numbers": (178.0, 2.5, RIGHT),
    }
    for row, (x, height, corner) in rows.items():
        assert offset_of_name(dot=(x, FIELD["bottom"] - height)) == corner, row


BESIDE = ((-9.0, -18.0), (20.0, -10.0), (-20.0, 0.0))
"""Dots, by their offsets from a dot, that take all seven places of its name beside it, but not the line upwards."""


def on_both_sides(*heights):
    """Dots 9 left and 9 right of the line upwards from a dot, at these heights (down): a name finds no room there."""
    return [(x, height) for height in heights for x in (-9.0, 9.0)]


def test_distant_name_has_a_line_that_crosses_no_dot():
    """Seven places beside a dot are taken; its name, 26.7 wide and 15 high, stands at the next that is free.

    Places are given by the upper left corner of the name from the dot (right, down), in their order by the height at
    which the line from the dot ends: the edge of the name that is nearer. A dot nearer than 7 to that line makes the
    place worse than a later one.
    """
    middle, left, right = -NAME_WIDTH / 2, -NAME_WIDTH, 0.0
    dot = (224.0, 112.0)
    rows = {
        "above": ([], (middle, -40.0), -25.0),
        "above, to the left": ([(9.0, -33.0)], (left, -40.0), -25.0),
        "above, to the right": ([(-9.0, -33.0)], (right, -40.0), -25.0),
        "below": (on_both_sides(-33.0), (middle, 14.0), 14.0),
        "higher": (on_both_sides(-33.0, 21.0), (middle, -58.0), -43.0),
        "lower": (on_both_sides(-33.0, 21.0, -51.0), (middle, 30.0), 30.0),
        "third above": (on_both_sides(-33.0, 21.0, -51.0, 37.0), (middle, -76.0), -61.0),
        "fourth above": (on_both_sides(-33.0, 21.0, -51.0, 37.0, -69.0), (middle, -94.0), -79.0),
        "a dot on the line upwards": ([(0.0, -13.0)], (middle, 14.0), 14.0),
        "a dot 6.5 left of that line": ([(-6.5, -13.0)], (middle, 14.0), 14.0),
        "a dot 7.5 left of that line": ([(-7.5, -13.0)], (middle, -40.0), -25.0),
        "a dot 6.5 right of that line": ([(6.5, -13.0)], (middle, 14.0), 14.0),
        "a dot 7.5 right of that line": ([(7.5, -13.0)], (middle, -40.0), -25.0),
    }
    for row, (more_dots, corner, end) in rows.items():
        plot = plot_of_names(dict.fromkeys([*BESIDE, *more_dots], ""), dot)
        assert offset_of(plot, "abc", dot) == corner, row
        (line,) = [ends for kind, ends in plot.lines if kind == "leader"]
        assert np.subtract(line, dot) == pytest.approx(np.array([(0.0, 0.0), (0.0, end)])), row


def test_later_name_avoids_the_line_of_an_earlier_name():
    """The name ``abc`` stands 58 above its dot; the dot ``i`` is 33 above that dot too, 13 left of the line.

    Right of its dot, from 10 to 15.7, ``i`` would cover that line: it stands on the left, up to 10 from its dot.
    """
    dot, later_dot = (224.0, 112.0), (224.0 - 13.0, 112.0 - 33.0)
    others = dict.fromkeys([*BESIDE, (9.0, -33.0), *on_both_sides(21.0)], "")
    plot = plot_of_names({(-13.0, -33.0): "i", **others}, dot)
    assert offset_of(plot, "abc", dot) == (-NAME_WIDTH / 2, -58.0)
    assert offset_of(plot, "i", later_dot) == (-10.0 - 5.7, -8.0)


def test_line_to_a_later_name_avoids_an_earlier_name():
    """The name ``abc`` stands right of its dot, 10 to 36.7 from it, 8 above to 7 below.

    The dot ``def`` lies below that name, and its places beside, 40 above and 14 below are taken. The line to the next
    place, 58 above, would cross the name ``abc``: it stands 30 below.
    """
    dot, later_dot = (224.0, 50.0), (224.0 + 23.0, 50.0 + 32.0)
    taken = [(23.0 + x, 32.0 + y) for x, y in [*BESIDE, *on_both_sides(21.0)]]
    plot = plot_of_names({(23.0, 32.0): "def", **dict.fromkeys(taken, "")}, dot)
    assert offset_of(plot, "abc", dot) == RIGHT
    assert offset_of(plot, "def", later_dot) == (-NAME_WIDTH / 2, 30.0)


def test_name_wider_than_the_field_is_left_out():
    """The field between the axes is 380 units wide, a name of 60 letters of 8.9 is 534; the other name finds room."""
    dots = [Dot("a" * 60, x=5.0, y=5.0), Dot("abc", x=2.0, y=5.0)]
    plot = scatter(dots, "", x_title="ms", y_axis=Axis("loss", [0, 5, 10]))
    assert [label.text for label in plot.labels if label.dot >= 0] == ["abc"]
