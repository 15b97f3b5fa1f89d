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


def scenes(case, seed=7):
    """Scenes of a hard case."""
    return list(MAKERS[case](np.random.default_rng(seed)))


@pytest.mark.sampled(3)
@pytest.mark.parametrize("case", [case for case in MAKERS if case not in BETWEEN])
def test_exact_is_right_on_every_scene_frame_and_face_list(case):
    """A scene states the verdict of each frame; faces are those that an exhaustive test finds."""
    for scene in scenes(case):
        detection = create_detector("exact", scene.bodies).detect(scene.motion, faces=True)
        assert np.array_equal(detection.verdict[:, 0], scene.truth), scene.name
        for frame in range(len(scene.motion)):
            assert np.array_equal(detection.faces(frame, 0), meeting_faces(scene.bodies, scene.motion, frame)), (
                scene.name
            )


@pytest.mark.parametrize("case", ["flush over a span", "nested shells"])
def test_flush_and_nested_scenes_know_where_bodies_touch(case):
    """A scene states the verdict of each frame; three of six distances of nested shells are short of the wall."""
    for scene in scenes(case):
        verdict = create_detector("exact", scene.bodies).detect(scene.motion).verdict[:, 0]
        assert np.array_equal(verdict, scene.truth), scene.name
        assert case != "nested shells" or (verdict == Verdict.CONTACT).sum() == len(verdict) / 2


@pytest.mark.parametrize(
    "case", ("malformed meshes", "far from the origin", "unit errors", "resting contact", *BETWEEN)
)
def test_cases_hold_contacts_and_misses(case):
    """A truth is 1 for contact and 0 for none."""
    assert {0, 1} == {truth for scene in scenes(case) for truth in scene.truth.tolist()}


def test_lifted_glass_is_clear_and_sunk_glass_meets_the_table():
    """The third word of a scene's name is the height at which the glass stands, below 0 in the table."""
    for scene in resting_scenes(np.random.default_rng(0)):
        assert (scene.truth[0] == Verdict.CONTACT) == (float(scene.name.split()[2]) <= 0), scene.name


def test_planted_crossings_start_above_and_end_below_the_plane():
    """Seven crossings follow each other in one motion; no path is known from the end of one to the next."""
    motion = crossing_motion(speed=1.0, phases=7)
    height = motion.translations[:, 0, 2].reshape(7, -1)
    assert (height[:, 0] > 0.003).all() and (height[:, -1] < -0.003).all()
    assert not motion.linked.reshape(7, -1, 2)[:, 0].any() and motion.linked.reshape(7, -1, 2)[:, 1:].all()


def volume(mesh):
    """The volume of a closed mesh."""
    return np.linalg.det(mesh.triangles).sum() / 6


def test_meshes_have_the_volumes_of_their_shapes():
    """Polygons with n sides approach the round shape; the beaker is a cylinder of 2 pi less its bore of 0.9 x 1.9."""
    assert volume(shift_mesh(box_mesh((1, 2, 3)), [9, 8, 7])) == pytest.approx(6)
    assert volume(ball_mesh(1.0, rings=64, sides=64)) == pytest.approx(4 / 3 * np.pi, rel=5e-3)
    assert volume(icosphere_mesh()) == pytest.approx(trimesh.creation.icosphere(1).volume, rel=1e-12)
    assert volume(rod_mesh(radius=1.0, length=2.0, sides=400)) == pytest.approx(2 * np.pi, rel=1e-3)
    assert volume(beaker_mesh(radius=1.0, height=2.0, wall=0.1, sides=400)) == pytest.approx(
        (2 - 0.81 * 1.9) * np.pi, rel=1e-3
    )
    assert len(ball_mesh(1.0, rings=8, sides=16).vertices) == 2 + 7 * 16
