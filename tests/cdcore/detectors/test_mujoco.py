"""MuJoCo decides as exact hulls do, but for distances below its own tolerance; truth by sums of hulls and by planes."""

import numpy as np
import pytest
from support.shapes import box_mesh, hulls_at, lab_bodies_and_motion, motion_at_rest, random_rotations

from cdcore import Body, TriangleMesh, Verdict, create_detector
from cdcore.errors import InvalidMeshError

mujoco = pytest.importorskip("mujoco", reason="mujoco is no part of `test`: the extra engines")

BEAKER_AND_ROD = 4
"""Pair of the laboratory's bodies (table, beaker, rod, ball, wand): the first of those after the table's four."""
TOLERANCE = 1e-6
"""Metres: ``ccd_tolerance`` of MuJoCo, and more than the spacing of float32 in a body of metres."""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "settings", "margin_m"),
    [
        pytest.param("mujoco", {"margin_m": 0.0}, 0.0, id="MuJoCo"),
        pytest.param("mujoco", {"margin_m": 0.002}, 0.002, id="MuJoCo with a margin of 2 mm"),
        pytest.param("collider", {"shape": "hull"}, 0.0, id="collider"),
    ],
)
def test_hulls_are_in_contact_below_the_margin_beyond_tolerance(name, settings, margin_m):
    """Two random hulls, whose gap is known: contact at 1 mm, 10 um and 1 um (TOLERANCE) below the margin, none above
    it.
    """
    gaps = margin_m + np.array([-1e-3, -1e-5, -TOLERANCE, TOLERANCE, 1e-5, 1e-3])
    for seed in range(30):
        bodies, motion = hulls_at(seed, gaps)
        verdict = create_detector(name, bodies, **settings).detect(motion).verdict[:, 0]
        assert (verdict == Verdict.CONTACT).tolist() == [True] * 3 + [False] * 3, seed


@pytest.mark.parametrize("thickness", [0.0, 1e-9, 9e-6, 2e-5, 1e-3])
@pytest.mark.parametrize("size", [0.01, 2.0])
@pytest.mark.parametrize(("gap", "verdict"), [(1e-5, Verdict.CLEAR), (-1e-5, Verdict.CONTACT)])
def test_mujoco_sheet_touches_only_bodies_that_cross_it(size, thickness, gap, verdict):
    """A cube of 1 cm over a sheet of size x size x thickness metres: 10 um above its top, and 10 um deep in it."""
    sheet = box_mesh((size, size, thickness))
    cube_height = thickness / 2 + gap + 0.01 / 2
    bodies = [Body("sheet", sheet), Body("cube", box_mesh([0.01] * 3))]
    motion = motion_at_rest(bodies, [[0, 0, 0], [0, 0, cube_height]])
    assert create_detector("mujoco", bodies).detect(motion).verdict.tolist() == [[verdict]]


def test_a_body_may_be_called_anything():
    """MuJoCo names bodies in XML: here with spaces, a line break, a backslash or brackets. Four bodies
    are six pairs.
    """
    bodies = [Body(name, box_mesh()) for name in ("a\nb", "a b", "a\\nb", "<x>")]
    assert create_detector("mujoco", bodies).pairs.shape == (6, 2)


@pytest.mark.parametrize(
    "vertices",
    [
        pytest.param(
            box_mesh().vertices * [3e4, 3e4, 1e-4] @ random_rotations(np.random.default_rng(0)),
            id="tilted sheet of 30 km x 30 km x 0.1 mm",
        ),
        pytest.param(box_mesh().vertices * 1e100, id="edges of 1e100 m"),
    ],
)
def test_refused_mesh_is_named_in_a_single_line(vertices):
    """MuJoCo cannot take such meshes; the pattern has no line break, as a dot stands for none."""
    with pytest.raises(InvalidMeshError, match=r"^MuJoCo .*slab.*\Z"):
        create_detector("mujoco", [Body("slab", TriangleMesh(vertices, box_mesh().faces))])


def test_crowd_at_a_single_point_loses_no_contact():
    """40 boxes of 1 m whose centres are about 1 mm apart: all 40 * 39 / 2 = 780 pairs meet."""
    bodies = [Body(f"box {k}", box_mesh()) for k in range(40)]
    motion = motion_at_rest(bodies, np.random.default_rng(0).normal(scale=1e-3, size=(40, 3)))
    verdict = create_detector("mujoco", bodies).detect(motion).verdict
    assert verdict.shape == (1, 780)
    assert (verdict == Verdict.CONTACT).all()


def explanations_at_13_hz():
    """A detector that samples 60 frames of 90 Hz at 13 Hz, and its explanation of pair 4, beaker and rod, in each."""
    bodies, motion = lab_bodies_and_motion(frames=60)
    detector = create_detector("mujoco", bodies, rate_hz=13.0)
    no_faces = np.zeros((0, 2))
    explanations = [detector.explain(motion, frame, BEAKER_AND_ROD, no_faces) for frame in range(60)]
    return detector, bodies, motion, explanations


def test_explanation_states_which_frames_were_sampled():
    """A detector samples 60 frames of 90 Hz at 13 Hz: it counts as many samples as frames are explained
    as looked at.
    """
    detector, _bodies, motion, explanations = explanations_at_13_hz()
    assert sum(explanation.looked for explanation in explanations) == detector.detect(motion).work["looks"]


def test_explanation_states_in_which_frames_hulls_meet():
    """A detector of 13 Hz explains each of 60 frames of a beaker and a rod: their hulls meet where a detector that
    samples every frame reports contact; frames without a pose are left out.
    """
    _detector, bodies, motion, explanations = explanations_at_13_hz()
    verdict = create_detector("mujoco", bodies).detect(motion).verdict[:, BEAKER_AND_ROD]
    has_pose = verdict != Verdict.NO_POSE
    meet = np.array([explanation.shapes_meet for explanation in explanations])[has_pose]
    assert set(meet.tolist()) == {True, False}
    assert np.array_equal(meet, verdict[has_pose] == Verdict.CONTACT)
