"""Contained, malformed, far, scaled and kissing bodies: scenes of ``replay stress``, whose truth is how
they are built.
"""

from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.shapes import (
    ball_mesh,
    beaker_mesh,
    box_mesh,
    icosphere_mesh,
    lab_bodies_and_motion,
    random_rotations,
    shift_mesh,
    unrotated_motion,
)

from cdcore import Body, Motion, TriangleMesh, Verdict, create_detector, intersecting_faces
from cdcore.narrow.brute_force import meeting_faces_exhaustive
from cdcore.poses import rotation_from_quaternion
from cdcore.protocol import counts_as_contact
from replay.studies.stress.scenes import SCENE_CASES, meeting_faces

ON_MESHES = ["hybrid", "static", "discrete", "exact"]
"""Detectors that decide on the triangles of meshes."""
ODD_MESHES = 8
"""Scenes of the malformed meshes; their names are asked in the test, for making them compiles kernels."""
UNDECIDED_INSIDE = ("open", "an edge of three faces")
"""Malformed meshes with an opening through which a body can be neither inside nor outside."""
CORNERS = np.concatenate([np.eye(3), -np.eye(3)])
"""Of an octahedron, 1 m from its middle."""
OCTAHEDRON = [[a, b, c] for a in (0, 3) for b in (1, 4) for c in (2, 5)]
"""Its eight faces."""


@cache
def scenes_of_case(case):
    """Name -> scene of a hard case: bodies, a motion, and the true verdict of the first pair in each frame."""
    makers = dict(SCENE_CASES.values())
    return {scene.name: scene for scene in makers[case](np.random.default_rng(3))}


def detected(name, scene, **options):
    """The answer of a detector for a scene."""
    return create_detector(name, scene.bodies).detect(scene.motion, **options)


@pytest.mark.parametrize("name", ON_MESHES)
@pytest.mark.parametrize("case", ["containment", "cavity"])
def test_inner_body_is_contained_unlike_a_body_in_a_cavity(name, case):
    """Scenes in which a body floats inside a closed one (CONTAINED), or in its cavity, which is outside (CLEAR).

    ``truth`` is how a scene was built; whether a body is inside is decided of all.
    """
    scenes = scenes_of_case(case)
    assert scenes
    for scene in scenes.values():
        detection = detected(name, scene)
        assert np.array_equal(detection.verdict[:, 0], scene.truth), scene.name
        assert detection.containment == ("decided",)


@pytest.mark.parametrize("name", ON_MESHES)
def test_ball_through_the_wall_is_clear_then_contact_then_contained(name):
    """A ball of radius 0.1 m moves from 1.0125 m by 25 mm a frame to the middle of a box, whose wall is at 0.5 m.

    It crosses the wall from 0.6 to 0.4 m: after 17 frames (0.5875 m), for 8 frames (to 0.4125 m).
    """
    positions = np.zeros((41, 2, 3))
    positions[:, 0, 0] = 1.0125 - 0.025 * np.arange(41)
    bodies = [Body("ball", ball_mesh(0.1)), Body("box", box_mesh())]
    verdict = create_detector(name, bodies).detect(unrotated_motion(positions)).verdict[:, 0].tolist()
    assert verdict == 17 * [Verdict.CLEAR] + 8 * [Verdict.CONTACT] + 16 * [Verdict.CONTAINED]


def test_float32_quaternions_do_not_scale_the_body():
    """200 quaternions rounded to float32: their norms are off by more than 1e-9, lengths they rotate by
    rounding only.
    """
    angles = np.random.default_rng(0).uniform(-3, 3, (200, 3))
    quaternions = Rotation.from_euler("xyz", angles).as_quat().astype(np.float32)
    norms = np.linalg.norm(quaternions.astype(float), axis=1)
    assert np.abs(norms - 1).max() > 1e-9
    point = np.array([0.3, 0.4, 0.5])
    lengths = np.linalg.norm(rotation_from_quaternion(quaternions) @ point, axis=1) / np.linalg.norm(point)
    assert np.abs(lengths - 1).max() < 1e-15


@pytest.mark.sampled(40)
@pytest.mark.parametrize("name", ["sphere", *ON_MESHES])
@pytest.mark.parametrize("row", range(ODD_MESHES))
def test_malformed_mesh_loses_no_contact(name, row):
    """Unused vertices, degenerate or repeated faces, or holes, in three frames: two in contact, one 3 m away.

    3 m away it is clear, by bounding spheres (``sphere``) too: a far vertex that no face uses does not enlarge them.
    """
    assert len(scenes_of_case("malformed meshes")) == ODD_MESHES
    scene = [*scenes_of_case("malformed meshes").values()][row]
    verdict = detected(name, scene).verdict[:, 0]
    assert counts_as_contact(verdict)[scene.truth == Verdict.CONTACT].all()
    assert verdict[2] == Verdict.CLEAR


@pytest.mark.sampled(40)
@pytest.mark.parametrize("name", ON_MESHES)
@pytest.mark.parametrize("row", range(ODD_MESHES))
def test_malformed_mesh_changes_no_verdict_and_no_face_pair(name, row):
    """A mesh with unused vertices, degenerate or repeated faces, or holes, in three frames beside another; truth is
    brute force over all faces.

    Where a mesh has holes, inside is undecided.
    """
    mesh, scene = [*scenes_of_case("malformed meshes").items()][row]
    detection = detected(name, scene, faces=True)
    assert np.array_equal(detection.verdict[:, 0], scene.truth)
    for frame in range(3):
        expected = meeting_faces(scene.bodies, scene.motion, frame)
        assert np.array_equal(detection.faces(frame, pair=0), expected), frame
    undecided = "partly: inside undecided: second has holes"
    assert detection.containment == (undecided if mesh in UNDECIDED_INSIDE else "decided",)


@pytest.mark.sampled(2)
@pytest.mark.parametrize("name", ["sphere", *ON_MESHES])
def test_far_from_the_origin_no_contact_is_lost(name):
    """1 to 10,000 km from the origin a ball and a box meet in the first frame and are 1 cm apart in the last.

    Their bounding spheres overlap there too.
    """
    scenes = scenes_of_case("far from the origin")
    assert scenes
    for scene in scenes.values():
        verdict = detected(name, scene).verdict[:, 0]
        assert counts_as_contact(verdict)[0]
        assert verdict[-1] == (Verdict.CANDIDATE if name == "sphere" else Verdict.CLEAR)


@pytest.mark.parametrize("local", [0.0, 1.0, 1e3], ids="{:g} m from their bodies".format)
@pytest.mark.parametrize("world", [0.0, 1.0, 1e3, 1e6], ids="bodies {:g} m from the origin".format)
@pytest.mark.parametrize("mode", ["paper", "best"])
def test_tangent_spheres_of_touching_bodies_overlap(local, world, mode):
    """Two octahedra share one vertex, at which their bounding spheres are exactly tangent, in 1,000 random poses.

    Spheres are those of the paper, or the best known. ``local``: how far meshes lie from their bodies' origin;
    ``world``: how far bodies lie from that of the world.
    """
    rng, count = np.random.default_rng(7), 1000
    shift = rng.normal(size=3) * local
    meshes = (TriangleMesh(CORNERS * 0.25 + shift + [x, 0, 0], OCTAHEDRON) for x in (0.0, 0.5))
    bodies = [Body(name, mesh) for name, mesh in zip("ab", meshes, strict=True)]
    rotation, position = random_rotations(rng, count), rng.normal(size=(count, 3)) * world
    position[: count // 2] -= rotation[: count // 2] @ shift
    motion = Motion(np.arange(count), np.repeat(position[:, None], 2, 1), np.repeat(rotation[:, None], 2, 1))
    verdict = create_detector("sphere", bodies, sphere=mode).detect(motion).verdict
    assert (verdict == Verdict.CANDIDATE).all()


@pytest.mark.sampled(4)
@pytest.mark.parametrize("power", [-20, -10, 10, 20])
def test_scaling_by_a_power_of_two_changes_no_face(power):
    """Five bodies of a laboratory in 60 frames, meshes and positions scaled by 2^power, which rounds nothing.

    Digests of verdicts and of faces stay the same.
    """
    bodies, motion = lab_bodies_and_motion(frames=60, seed=2)
    scale = 2.0**power
    scaled_bodies = [Body(body.name, TriangleMesh(body.mesh.vertices * scale, body.mesh.faces)) for body in bodies]
    scaled_motion = Motion(motion.times, motion.translations * scale, motion.rotations, motion.valid)
    detection = create_detector("exact", bodies).detect(motion, faces=True)
    of_scaled = create_detector("exact", scaled_bodies).detect(scaled_motion, faces=True)
    assert (detection.verdict == Verdict.CONTACT).any()
    assert (detection.digest, detection.faces_digest) == (of_scaled.digest, of_scaled.faces_digest)


def octahedra_tip_to_tip():
    """Two octahedra of radius 1 m whose middles are 2 m apart; four faces of each have the corner in common."""
    return (TriangleMesh(np.add(CORNERS, [x, 0, 0]), OCTAHEDRON) for x in (0.0, 2.0))


def test_meshes_touching_in_a_vertex_meet_in_its_faces():
    """Two octahedra tip to tip: 4 x 4 faces. Two icospheres of radius 1 m, pole on pole, with six faces each: 6 x 6."""
    first, second = octahedra_tip_to_tip()
    ball = icosphere_mesh()
    assert len(intersecting_faces(first, second)) == 4 * 4
    assert len(intersecting_faces(ball, shift_mesh(ball, [0, 0, 2]))) == 6 * 6


def test_exhaustive_search_finds_faces_that_touch_in_a_vertex():
    """Two octahedra tip to tip: 4 x 4 faces."""
    first, second = octahedra_tip_to_tip()
    assert len(meeting_faces_exhaustive(first.triangles, second.triangles)) == 4 * 4


def test_mesh_upon_itself_meets_in_every_face():
    """A beaker: each of its faces meets itself, and others."""
    beaker = beaker_mesh(sides=10)
    meeting_itself = {first for first, second in intersecting_faces(beaker, beaker).tolist() if first == second}
    assert meeting_itself == set(range(len(beaker.faces)))
