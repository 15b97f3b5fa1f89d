"""Scenes are what they say of themselves, and their solids those of their names."""

import numpy as np
import pytest
import trimesh

from cdcore import Verdict, create_detector
from replay.studies.stress.scenes import SCENE_CASES, crossing_motion, meeting_faces, resting_scenes
from replay.studies.stress.solids import ball_mesh, beaker_mesh, box_mesh, icosphere_mesh, rod_mesh, shift_mesh

BETWEEN = (*range(29, 34), 44, 48)


def scenes(number, seed=7):
    """Scenes of a numbered hard case."""
    return list(SCENE_CASES[number][1](np.random.default_rng(seed)))


@pytest.mark.sampled(3)
@pytest.mark.parametrize("number", sorted(SCENE_CASES.keys() - set(BETWEEN)))
def test_exact_is_right_on_every_scene_frame_and_face_list(number):
    for scene in scenes(number):
        detection = create_detector("exact", scene.bodies).detect(scene.motion, faces=True)
        assert np.array_equal(detection.verdict[:, 0], scene.truth), scene.name
        for frame in range(len(scene.motion)):
            assert np.array_equal(detection.faces(frame, 0), meeting_faces(scene.bodies, scene.motion, frame)), (
                scene.name
            )


@pytest.mark.parametrize("number", [45, 46])
def test_flush_and_nested_scenes_know_where_bodies_touch(number):
    for scene in scenes(number):
        verdict = create_detector("exact", scene.bodies).detect(scene.motion).verdict[:, 0]
        assert np.array_equal(verdict, scene.truth), scene.name
        # Nested: three of six distances are short of the wall by a hair or more.
        assert number == 45 or (verdict == Verdict.CONTACT).sum() == len(verdict) / 2


@pytest.mark.parametrize("number", [37, 38, 39, 41, *BETWEEN])
def test_cases_hold_contacts_and_misses(number):
    assert {0, 1} == {truth for scene in scenes(number) for truth in scene.truth.tolist()}


def test_lifted_glass_is_clear_and_sunk_glass_meets_the_table():
    for scene in resting_scenes(np.random.default_rng(0)):
        assert (scene.truth[0] == Verdict.CONTACT) == (float(scene.name.split()[2]) <= 0), scene.name


def test_planted_crossings_start_above_and_end_below_the_plane():
    """Seven crossings follow each other in one motion; no path is known from the end of one to the next."""
    motion = crossing_motion(speed=1.0, phases=7)
    height = motion.translations[:, 0, 2].reshape(7, -1)
    assert (height[:, 0] > 0.003).all() and (height[:, -1] < -0.003).all()
    assert not motion.linked.reshape(7, -1, 2)[:, 0].any() and motion.linked.reshape(7, -1, 2)[:, 1:].all()


def volume(mesh):
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
