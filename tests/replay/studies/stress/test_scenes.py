"""Scenes are what they say of themselves, and their solids those of their names."""

import numpy as np
import pytest
import trimesh

from cdcore import Verdict, create_detector
from replay.studies.stress.scenes import SCENE_CASES, crossing_motion, meeting_faces, resting_scenes
from replay.studies.stress.solids import ball_mesh, beaker_mesh, box_mesh, icosphere_mesh, rod_mesh, shift_mesh

MAKERS = dict(SCENE_CASES.values())
"""Name of a hard case -> what makes its scenes."""
BETWEEN = (
    "thin-wall phases",
    "rotation only",
    "start, end, no motion",
    "grazing",
    "time reversal and splitting",
    "glancing spins",
    "crossings far away",
)
"""Cases that ask about the time between frames."""


def scenes_of_case(case):
    """Scenes of a hard case, drawn from a fixed seed."""
    return list(MAKERS[case](np.random.default_rng(7)))


@pytest.mark.sampled(3)
@pytest.mark.parametrize("case", [case for case in MAKERS if case not in BETWEEN])
def test_exact_is_right_on_every_scene_frame_and_face_list(case):
    """A scene has two bodies, a motion, and the verdict of each frame (``truth``) as it was made.

    The face pairs that meet are those of a test of every face against every other.
    """
    for scene in scenes_of_case(case):
        detection = create_detector("exact", scene.bodies).detect(scene.motion, faces=True)
        only_pair = 0
        assert np.array_equal(detection.verdict[:, only_pair], scene.truth), scene.name
        for frame in range(len(scene.motion)):
            expected = meeting_faces(scene.bodies, scene.motion, frame)
            assert np.array_equal(detection.faces(frame, only_pair), expected), scene.name


@pytest.mark.parametrize("case", ["flush over a span", "nested shells"])
def test_exact_agrees_with_flush_and_nested_scenes(case):
    """Blocks that lie flush on a table or in a slot, and shells in one another; a scene states each frame's verdict."""
    for scene in scenes_of_case(case):
        verdict = create_detector("exact", scene.bodies).detect(scene.motion).verdict[:, 0]
        assert np.array_equal(verdict, scene.truth), scene.name


def test_half_of_the_nested_shells_touch():
    """A box in a solid or a shell stands at six distances from the middle, of which the last three reach the wall."""
    for scene in scenes_of_case("nested shells"):
        assert (scene.truth == Verdict.CONTACT).sum() == len(scene.truth) / 2, scene.name


@pytest.mark.parametrize(
    "case", ("malformed meshes", "far from the origin", "unit errors", "resting contact", *BETWEEN)
)
def test_cases_hold_contacts_and_misses(case):
    """Truths of the scenes: 1 is contact, at a frame or in a time between frames, and 0 none; every case has both."""
    assert {truth for scene in scenes_of_case(case) for truth in scene.truth.tolist()} == {0, 1}


def test_lifted_glass_is_clear_and_sunk_glass_meets_the_table():
    """The third word of a scene's name is the height at which the glass stands, below 0 in the table."""
    scenes = list(resting_scenes(np.random.default_rng(0)))
    heights = [float(scene.name.split()[2]) for scene in scenes]
    assert min(heights) < 0 < max(heights)
    for scene, height in zip(scenes, heights, strict=True):
        assert (scene.truth[0] == Verdict.CONTACT) == (height <= 0), scene.name


def test_planted_crossings_start_above_and_end_below_the_plane():
    """Seven times a cube of 5 mm falls through a plate of 1 mm at Z = 0: they meet while the cube is within 3 mm.

    The crossings follow each other in one motion; the first frame of each is not linked to the frame before.
    """
    motion = crossing_motion(speed=1.0, phases=7)
    cube = 0
    heights = motion.translations[:, cube, 2].reshape(7, -1)
    assert (heights[:, 0] > 0.003).all() and (heights[:, -1] < -0.003).all()
    linked = motion.linked.reshape(7, -1, 2)
    assert not linked[:, 0].any()
    assert linked[:, 1:].all()


def volume(mesh):
    """The volume of a closed mesh."""
    return np.linalg.det(mesh.triangles).sum() / 6


@pytest.mark.parametrize(
    ("mesh", "expected", "rel"),
    [
        pytest.param(shift_mesh(box_mesh((1, 2, 3)), [9, 8, 7]), 1 * 2 * 3, 1e-6, id="box, shifted"),
        # Polygons approach the round shape: with n sides they lack about 2 pi^2 / 3 n^2 of the area of a circle.
        pytest.param(ball_mesh(1.0, rings=64, sides=64), 4 / 3 * np.pi, 5e-3, id="ball"),
        pytest.param(icosphere_mesh(), trimesh.creation.icosphere(1).volume, 1e-12, id="icosphere of trimesh"),
        pytest.param(rod_mesh(radius=1.0, length=2.0, sides=400), 2 * np.pi, 1e-3, id="rod"),
        # a cylinder of radius 1 and height 2, less a bore of radius 0.9 and height 1.9 above a floor of 0.1
        pytest.param(
            beaker_mesh(radius=1.0, height=2.0, wall=0.1, sides=400), (2 - 0.9**2 * 1.9) * np.pi, 1e-3, id="beaker"
        ),
    ],
)
def test_meshes_have_the_volumes_of_their_shapes(mesh, expected, rel):
    """A mesh as scenes use them, and the volume of its shape; ``rel``: relative tolerance, wide for round shapes."""
    assert volume(mesh) == pytest.approx(expected, rel=rel)


def test_ball_has_two_poles_and_rings_of_vertices():
    """Eight rings of faces from pole to pole have seven rings of 16 vertices between them."""
    assert len(ball_mesh(1.0, rings=8, sides=16).vertices) == 2 + 7 * 16
