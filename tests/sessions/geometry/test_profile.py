import numpy as np
import pytest

from sessions.geometry.profile import (
    Arc,
    Line,
    clipped_polyline,
    level_holding,
    offset,
    rounded_strokes,
    sampled_polyline,
    solve_rising,
    volume_below,
)


def test_root_is_exact_to_the_last_bits():
    """x * x - 2 rises through 0 at the root of 2, which is also given rounded to three decimals."""
    assert solve_rising(lambda x: x * x - 2.0, lower=0.0, upper=2.0) == pytest.approx(np.sqrt(2.0), rel=1e-15, abs=0)
    assert solve_rising(lambda x: x * x - 2.0, lower=0.0, upper=2.0, decimals=3) == 1.414


def test_segments_are_shared_among_lines_by_their_length():
    """Eight segments are laid along lines of 1 and 3 m, far from the origin: each is half a metre long."""
    polyline = sampled_polyline([Line((10.0, 20.0), (11.0, 20.0)), Line((11.0, 20.0), (11.0, 23.0))], 8)
    assert np.linalg.norm(np.diff(polyline, axis=0), axis=1) == pytest.approx([0.5] * 8)


CUP = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 2.0], [2.0, 3.0], [2.0, 4.0]])
"""(Radius, height) of a cup: radius 1 up to height 2, growing to 2 at height 3, and 2 up to height 4."""


def test_volume_of_cylinder_and_cone_cup_matches_closed_form():
    """The cup CUP is filled up to a level: its volume, in units of pi, and the level of that volume.

    A cylinder of radius 1 and height h has h, the cone from radius 1 to r has (r^3 - 1) / 3, and the wide cylinder on
    top, of radius 2, has 4 h.
    """
    cone_to_middle, whole_cone = (1.5**3 - 1.0) / 3.0, (2.0**3 - 1.0) / 3.0
    volumes = {0.5: 0.5, 2.0: 2.0, 2.5: 2.0 + cone_to_middle, 3.5: 2.0 + whole_cone + 4 * 0.5}
    for level, volume in volumes.items():
        assert volume_below(CUP, level) == pytest.approx(np.pi * volume, rel=1e-14, abs=0), level
        assert level_holding(CUP, np.pi * volume) == pytest.approx(level, rel=1e-14, abs=0), level


def test_profile_is_clipped_between_its_corners():
    """At a height of 2.5 the cone of CUP has a radius of 1.5; a height just above a corner replaces that corner."""
    assert clipped_polyline(CUP, 2.5).tolist() == [[0.0, 0.0], [1.0, 0.0], [1.0, 2.0], [1.5, 2.5]]
    *_lower, (_, floor), (_, top) = clipped_polyline(CUP, 2.0 + 1e-7).tolist()
    assert (floor, top) == pytest.approx((0.0, 2.0 + 1e-7))


def test_offset_moves_wall_and_floor_outwards():
    """Floor and wall of CUP's lower cylinder are moved outwards by 0.1, to their common corner."""
    lower_cylinder = CUP[:3]
    assert offset(lower_cylinder, 0.1) == pytest.approx(np.array([[0.0, -0.1], [1.1, -0.1], [1.1, 2.0]]))


def test_rounded_corner_is_a_tangent_quarter_circle():
    """A path from (1, 1) to (2, 1) and up to (2, 4) has its corner rounded by a radius of 0.5.

    The strokes are a line, a quarter circle, which ends at the angle 0, and a line.
    """
    first, arc, last = rounded_strokes([(1.0, 1.0), (2.0, 1.0, 0.5), (2.0, 4.0)])
    assert first.end == pytest.approx((1.5, 1.0))
    assert arc.centre == (1.5, 1.5)
    assert arc.finish == pytest.approx(0.0, abs=1e-15)
    assert last.start == pytest.approx((2.0, 1.5))
    assert arc.weight == pytest.approx(0.25 * np.pi)


def test_weight_of_an_arc_is_its_length():
    """An arc of radius 2 goes from the angle 1 to the angle 3: 2 rad times 2."""
    assert Arc((0.0, 0.0), radius=2.0, begin=1.0, finish=3.0).weight == pytest.approx(4.0)
