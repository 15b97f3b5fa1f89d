"""Lanes, rulers and paths of a page's charts."""

import pytest

from replay.show.report import charts
from replay.show.report.charts import lane, path_of, ruler


def test_corners_between_two_of_their_height_are_left_out():
    """Corners are (x, y): of three at height 5 the middle one adds nothing."""
    corners = [(0, 0), (1, 5), (2, 5), (3, 5), (4, 0)]
    assert path_of(corners) == "M0.0 0.0L1.0 5.0L3.0 5.0L4.0 0.0"
    assert path_of([(0, 5), (1, 5), (2, 5)]) == "M0.0 5.0L2.0 5.0"


def boxes(*spans):
    """The path of boxes of these spans, 20 high."""
    return "".join(f"M{start:.3f} 0H{end:.3f}V20H{start:.3f}Z" for start, end in spans)


@pytest.mark.parametrize(
    ("spans", "drawn"),
    [
        ([(0, 3), (1, 2), (5, 6)], [(0, 3), (5, 6)]),
        ([(0, 2), (2, 4)], [(0, 4)]),
        ([(-2, 1), (9, 12), (12, 13), (4, 4)], [(0, 1), (9, 10)]),
        ([(0, 1), (1.004, 2)], [(0, 1), (1.004, 2)]),
        ([(0, 1), (1.004, 2), (3, 4)], [(0, 2), (3, 4)]),
        ([(0, 1), (1.006, 2), (3, 4)], [(0, 1), (1.006, 2), (3, 4)]),
    ],
)
def test_neighbouring_spans_are_joined_if_there_are_many(monkeypatch, spans, drawn):
    """In a window of 10 s spans that overlap are joined, and of more than two also those 10/2000 s apart."""
    monkeypatch.setattr(charts, "MOST_BOXES", 2)
    paths = dict(lane({"false": spans}, (0.0, 10.0), "hull").paths)
    assert paths["false"] == boxes(*drawn)


def test_span_below_a_300th_of_the_window_has_a_tick():
    """Spans of 1 s and of 0.9 s in a window from 100 to 400 s, and the moment of the picture."""
    drawn = lane({"false": [(100.0, 101.0), (102.0, 102.9)]}, (100.0, 400.0), "hull", marked_second=130.0)
    assert dict(drawn.paths)["false tick"] == "M2.450 0V20" and dict(drawn.paths)["now"] == "M30.000 0V20"
    assert lane({}, (0.0, 10.0), "hull").paths == []


@pytest.mark.parametrize(
    ("start", "end", "ticks"),  # seconds; (percent of the width, label)
    [
        (10.0, 20.0, [(0, "10"), (20, "12"), (40, "14"), (60, "16"), (80, "18"), (100, "20 s")]),
        (0.0, 59.96, [*((100 * tick / 59.96, str(tick)) for tick in range(0, 60, 10)), (100, "60 s")]),
        (0.25, 20.25, [(0, "0.25"), (25, "5.25"), (50, "10.25"), (75, "15.25"), (100, "20.25 s")]),
    ],
)
def test_ruler_begins_and_ends_with_the_window(start, end, ticks):
    """A window to 59.96 s ends as 60 s, the number that is printed of it."""
    positions, labels = zip(*ruler(start, end), strict=True)
    assert positions == pytest.approx([position for position, _ in ticks]) and [*labels] == [
        label for _, label in ticks
    ]
