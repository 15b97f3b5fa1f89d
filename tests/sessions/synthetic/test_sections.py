import numpy as np
import pytest
from support.small_worlds import prism

from sessions.geometry.rings import even_angles, revolved_rings, sewn
from sessions.geometry.rotations import quaternion_about
from sessions.geometry.solids import box
from sessions.synthetic.sections import approach, round_in_round


def test_a_cube_corner_meets_a_prism_between_the_bounds():
    """Seen from above, a square of 0.1 m comes corner first at a 64-gon of radius 0.03 m.

    They meet where their middles are half a diagonal and the radius apart: between the distances ``sure`` and
    ``possible``, which are within 0.1 mm of their mean (``slack``), and without moving the cube ``aside``.
    """
    cube, post = box((0.1, 0.1, 0.1)), prism(sides=64, radius=0.03, length=0.5)
    corner_first = quaternion_about((0.0, 1.0, 0.0), np.radians(45.0))
    meets = approach(cube, corner_first, post, direction=(0.0, 0.0, -1.0), height=0.05)
    half_diagonal = 0.05 * np.sqrt(2.0)
    assert meets.sure <= half_diagonal + 0.03 <= meets.possible + 1e-9
    assert meets.slack < 0.0001
    assert abs(meets.aside) < 1e-9


def test_play_of_prism_in_ring_is_difference_of_radii():
    """A prism of radius 0.01 in a ring of 0.05; flat sides of 12 and 64 reach only cos(pi / n) of the radius."""
    corners = [(0.05, -0.05), (0.06, -0.05), (0.06, 0.05), (0.05, 0.05)]
    ring = sewn(revolved_rings(np.array(corners), even_angles(64), 1.0 / np.cos(np.pi / 64)), around=True)
    sure, possible = round_in_round(prism(sides=12, radius=0.01, length=0.4), ring, 0.0)
    assert possible == pytest.approx(0.05 - 0.01, rel=0.01)
    assert sure == pytest.approx(0.05 / np.cos(np.pi / 64) - 0.01 * np.cos(np.pi / 12), rel=1e-6)


@pytest.mark.parametrize(
    "outline",
    [
        [(0.02, 0.0), (0.01, 0.01)],  # a foot
        [(0.01, 0.0), (0.02, 0.01)],  # a brim
        [(0.01, 0.0), (0.02, 0.0003), (0.02, 0.0007), (0.01, 0.001)],  # a collar
    ],
)
@pytest.mark.parametrize("height", [0.0, -0.05])
def test_widest_section_bounds_the_play(outline, height):
    """Corners (radius, height) of a body whose largest radius is 0.02, in a prism of radius 0.05."""
    lowest, highest = outline[0][1], outline[-1][1]
    body = sewn(revolved_rings(np.array([(0.0, lowest), *outline, (0.0, highest)]), even_angles(64), 1.0))
    play = round_in_round(body, prism(sides=64, radius=0.05, length=0.4), height)[1]
    assert play == pytest.approx(0.05 * np.cos(np.pi / 64) - 0.02, abs=1e-5)
