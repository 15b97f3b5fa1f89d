"""MuJoCo decides as exact hulls do, but for distances below its own tolerance; truth by sums of hulls and by planes."""

import numpy as np
import pytest
from support.shapes import box_mesh, hulls_at, lab_bodies_and_motion, motion_at_rest, random_rotations

from cdcore import Body, TriangleMesh, Verdict, create_detector
from cdcore.errors import InvalidMeshError

mujoco = pytest.importorskip("mujoco", reason="mujoco is no part of `test`: the extra engines")

TOLERANCE = 1e-6
"""Metres: ``ccd_tolerance`` of MuJoCo, and more than the spacing of float32 in a body of metres."""


@pytest.mark.slow
@pytest.mark.parametrize("margin", [0.0, 0.002])
def test_mujoco_agrees_with_exact_hulls_beyond_its_tolerance(margin):
    """Three gaps are below the margin and three above, the nearest by TOLERANCE."""
    gaps = margin + np.array([-1e-3, -1e-5, -TOLERANCE, TOLERANCE, 1e-5, 1e-3])
    for seed in range(30):
        bodies, motion = hulls_at(seed, gaps)
        answer = create_detector("mujoco", bodies, margin_m=margin).detect(motion).verdict[:, 0]
        assert (answer == Verdict.CONTACT).tolist() == [True] * 3 + [False] * 3
        assert margin or np.array_equal(answer, create_detector("collider", bodies).detect(motion).verdict[:, 0])


@pytest.mark.parametrize("thickness", [0.0, 1e-9, 9e-6, 2e-5, 1e-3])
@pytest.mark.parametrize("size", [0.01, 2.0])
def test_mujoco_sheet_touches_only_bodies_that_cross_it(thickness, size):
    """A cube of 1 cm, 10 um above the sheet's top and 10 um deep in it."""
    sheet = TriangleMesh(box_mesh().vertices * [size, size, thickness], box_mesh().faces)
    top, half = sheet.vertices[:, 2].max(), np.ptp(box_mesh().vertices[:, 2]) * 0.005
    small = TriangleMesh(box_mesh().vertices * 0.01, box_mesh().faces)
    bodies = [Body("sheet", sheet), Body("small", small)]
    for height, word in ((top + half + 1e-5, Verdict.CLEAR), (top + half - 1e-5, Verdict.CONTACT)):
        assert (
            create_detector("mujoco", bodies).detect(motion_at_rest(bodies, [[0, 0, 0], [0, 0, height]])).verdict[0, 0]
            == word
        )


def test_a_body_may_be_called_anything():
    """Four bodies, whose names have spaces, a line break, a backslash or brackets, are six pairs."""
    bodies = [Body(name, box_mesh()) for name in ("a\nb", "a b", "a\\nb", "<x>")]
    assert create_detector("mujoco", bodies).pairs.shape == (6, 2)


def test_refused_mesh_is_named_in_a_single_line():
    """The body is a sheet of 30 km by 30 km by 0.1 mm, or a cube with edges of 1e100 m."""
    box, rotation = box_mesh(), random_rotations(np.random.default_rng(0), 1)[0]
    for vertices in (box.vertices * [3e4, 3e4, 1e-4] @ rotation, box.vertices * 1e100):
        with pytest.raises(InvalidMeshError, match=r"^MuJoCo .*slab.*$"):
            create_detector("mujoco", [Body("slab", TriangleMesh(vertices, box.faces))])


def test_crowd_at_a_single_point_loses_no_contact():
    """40 boxes of 1 m whose centres are about 1 mm apart: all pairs meet."""
    bodies = [Body(f"box {k}", box_mesh()) for k in range(40)]
    motion = motion_at_rest(bodies, np.random.default_rng(0).normal(scale=1e-3, size=(40, 3)))
    assert (create_detector("mujoco", bodies).detect(motion).verdict == Verdict.CONTACT).all()


def test_explanation_states_sampling_and_meeting_hulls():
    """Frames explained as sampled are as many as the detector of 13 Hz counts.

    Its hulls meet in the frames in which the detector that samples every frame reports contact.
    """
    bodies, motion = lab_bodies_and_motion(frames=60)
    always, slow = (create_detector("mujoco", bodies, rate_hz=rate) for rate in (None, 13.0))
    sample, pair = always.detect(motion).verdict, 4
    reported = [slow.explain(motion, frame, pair, np.zeros((0, 2))) for frame in range(60)]
    assert sum(item.looked for item in reported) == slow.detect(motion).work["looks"]
    known = sample[:, pair] != Verdict.NO_POSE
    meet = np.array([item.shapes_meet for item in reported])
    assert {True, False} == set(meet[known].tolist())
    assert np.array_equal(meet[known], sample[known, pair] == Verdict.CONTACT)
