import numpy as np
import pytest
from support.small_worlds import prism

from sessions.geometry.rings import even_angles, revolved_rings, sewn
from sessions.geometry.rotations import quaternion_about
from sessions.geometry.solids import box
from sessions.synthetic.sections import approach, round_in_round


def test_a_cube_corner_meets_a_prism_between_the_bounds():
    """Seen from above, a cube with an edge of 0.04 m comes corner first at a 64-gon of radius 0.03 m.

    They meet where their middles are half a diagonal and the radius from each other: between the distances ``sure``
    and ``possible``, which are within 0.1 mm of their mean (``slack``), and without moving the cube ``aside``.
    """
    edge, radius = 0.04, 0.03
    cube, post = box((edge, edge, edge)), prism(sides=64, radius=radius, length=0.5)
    corner_first = quaternion_about((0.0, 1.0, 0.0), np.radians(45.0))
    meeting = approach(cube, corner_first, post, direction=(0.0, 0.0, -1.0), height=0.05)
    half_diagonal = edge / 2 * np.sqrt(2.0)
    assert meeting.sure <= half_diagonal + radius <= meeting.possible + 1e-9
    assert meeting.slack < 0.0001
    assert abs(meeting.aside) < 1e-9


def reach_of_flat_sides(sides):
    """The least distance of a regular polygon's sides from its middle, in radii of its corners."""
    return np.cos(np.pi / sides)


def test_play_of_prism_in_ring_is_difference_of_radii():
    """A prism of 12 sides, whose corners are 0.01 m from its axis, stands in a ring of 64 sides, 0.05 m at its middles.

    Moved aside it may touch from ``possible`` on, the difference of the radii, 0.04 m within 1 %. From ``sure`` on it
    touches whatever the direction: the ring's radius at its corners less the prism's at its sides.
    """
    corners = [(0.05, -0.01), (0.06, -0.01), (0.06, 0.01), (0.05, 0.01)]
    ring = sewn(revolved_rings(np.array(corners), even_angles(64), 1.0 / reach_of_flat_sides(64)), around=True)
    sure, possible = round_in_round(prism(sides=12, radius=0.01, length=0.4), ring, 0.0)
    assert possible == pytest.approx(0.05 - 0.01, rel=0.01)
    assert sure == pytest.approx(0.05 / reach_of_flat_sides(64) - 0.01 * reach_of_flat_sides(12), rel=1e-6)


@pytest.mark.parametrize(
    "outline",
    [
        pytest.param([(0.02, 0.0), (0.01, 0.01)], id="a foot"),
        pytest.param([(0.01, 0.0), (0.02, 0.01)], id="a brim"),
        pytest.param([(0.01, 0.0), (0.02, 0.0003), (0.02, 0.0007), (0.01, 0.001)], id="a collar"),
    ],
)
@pytest.mark.parametrize("height", [0.0, -0.05])
def test_widest_section_bounds_the_play(outline, height):
    """A body of revolution, its outline (radius, height) in metres, is 0.02 m wide in one place only.

    It stands in a tube of 64 flat sides, whose corners are 0.05 m from the axis, at a height. Moved aside it may touch
    (``possible``) where its widest section reaches a flat side.
    """
    (_, lowest), *_, (_, highest) = outline
    body = sewn(revolved_rings(np.array([(0.0, lowest), *outline, (0.0, highest)]), even_angles(64), 1.0))
    _sure, possible = round_in_round(body, prism(sides=64, radius=0.05, length=0.4), height)
    assert possible == pytest.approx(0.05 * reach_of_flat_sides(64) - 0.02, abs=1e-5)
