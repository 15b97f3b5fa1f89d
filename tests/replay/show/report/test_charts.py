"""Lanes, rulers and paths of a page's charts."""

import pytest

from replay.show.report import charts
from replay.show.report.charts import lane, path_of, ruler


def test_corners_between_two_of_their_height_are_left_out():
    """Corners are (x, y). Of three in a row at height 5 the middle adds nothing to an SVG path (M: begin, L: line)."""
    assert path_of([(0, 0), (1, 5), (2, 5), (3, 5), (4, 0)]) == "M0.0 0.0L1.0 5.0L3.0 5.0L4.0 0.0"
    assert path_of([(0, 5), (1, 5), (2, 5)]) == "M0.0 5.0L2.0 5.0"


def boxes(*spans):
    """The path of boxes of these spans, 20 high."""
    return "".join(f"M{start:.3f} 0H{end:.3f}V20H{start:.3f}Z" for start, end in spans)


def test_many_neighbouring_spans_are_joined(monkeypatch):
    """A window of 10 s. Spans of a kind that overlap or touch are drawn as one box, cut at the window's ends.

    Three are many here (thousands usually): then those less than a 2000th of the window apart, 5 ms, are joined too.
    """
    rows = {
        "a span within another": ([(0, 3), (1, 2), (5, 6)], [(0, 3), (5, 6)]),
        "spans that touch": ([(0, 2), (2, 4)], [(0, 4)]),
        "cut by the window, outside, empty": ([(-2, 1), (9, 12), (12, 13), (4, 4)], [(0, 1), (9, 10)]),
        "few, 4 ms apart": ([(0, 1), (1.004, 2)], [(0, 1), (1.004, 2)]),
        "many, 4 ms apart": ([(0, 1), (1.004, 2), (3, 4)], [(0, 2), (3, 4)]),
        "many, 6 ms apart": ([(0, 1), (1.006, 2), (3, 4)], [(0, 1), (1.006, 2), (3, 4)]),
    }
    monkeypatch.setattr(charts, "MOST_BOXES", 2)
    for row, (spans, drawn) in rows.items():
        paths = dict(lane({"false": spans}, window=(0.0, 10.0), label="hull").paths)
        assert paths["false"] == boxes(*drawn), row


def test_span_below_a_300th_of_the_window_has_a_tick():
    """A window from 100 to 400 s: a 300th is 1 s. A span of 1 s has none, one from 102 to 102.9 s a line at 102.45 s.

    The line of the moment of the picture, 130 s, is a path of its own. Paths count from the begin of the window.
    """
    drawn = lane({"false": [(100.0, 101.0), (102.0, 102.9)]}, (100.0, 400.0), "hull", marked_second=130.0)
    paths = dict(drawn.paths)
    assert paths["false tick"] == "M2.450 0V20"
    assert paths["now"] == "M30.000 0V20"


def test_lane_without_spans_has_no_paths():
    """The detector reported nothing, and no moment is marked."""
    assert lane({}, window=(0.0, 10.0), label="hull").paths == []


def test_ruler_begins_and_ends_with_the_window():
    """``seconds``: where labels stand; round steps from the begin of the window, and its end with the unit.

    A position is a percentage of the width. The end of a window of over 20 s is rounded: 59.96 reads "60 s".
    """
    rows = {
        "from 10 s": (10.0, 20.0, [10, 12, 14, 16, 18, 20], ["10", "12", "14", "16", "18", "20 s"]),
        "odd end": (0.0, 59.96, [0, 10, 20, 30, 40, 50, 59.96], ["0", "10", "20", "30", "40", "50", "60 s"]),
        "odd begin": (0.25, 20.25, [0.25, 5.25, 10.25, 15.25, 20.25], ["0.25", "5.25", "10.25", "15.25", "20.25 s"]),
    }
    for row, (start, end, seconds, labels) in rows.items():
        ticks = ruler(start, end)
        expected = [100 * (second - start) / (end - start) for second in seconds]
        assert [position for position, _ in ticks] == pytest.approx(expected), row
        assert [label for _, label in ticks] == labels, row
