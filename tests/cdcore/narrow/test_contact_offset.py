import numpy as np
import pytest
from support.small_worlds import along_x, cube

from cdcore import Body, Motion, TriangleMesh
from cdcore.narrow.contact_offset import ContactOffset

PLACES = [3.0, 1.25, 1.25, 1.125, 1.0625, 3.0]
"""Of the second of two unit cubes on the X axis: the gap is 1 less."""


@pytest.mark.parametrize("reach", [0.1, 0.2, 0.3])
def test_within_reach_are_cubes_whose_gap_is_no_wider(reach):
    bodies = tuple(Body(name, TriangleMesh(cube().vertices, cube().faces)) for name in "ab")
    places = np.stack([along_x([0.0] * len(PLACES))[0], along_x(PLACES)[0]], axis=1)
    motion = Motion(np.arange(len(PLACES)) / 90, places, np.tile(np.eye(3), (len(PLACES), 2, 1, 1)))
    asked, frames = ContactOffset(bodies, np.array([[0, 1]]), reach), np.arange(len(PLACES))
    assert asked.near(motion, frames, np.zeros_like(frames)).tolist() == [place - 1.0 <= reach for place in PLACES]
    assert asked.apart(motion, 3, 0) == pytest.approx(0.125 - reach)
