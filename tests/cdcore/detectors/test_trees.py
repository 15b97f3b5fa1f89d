"""Tree detectors, ``hybrid``, ``image-space``, and the spheres they begin with: what each leaves out and gets right."""

import numpy as np
import pytest
from support.shapes import (
    ball_mesh,
    beaker_mesh,
    box_mesh,
    lab_bodies_and_motion,
    motion_at_rest,
    rod_mesh,
    without_faces,
)

from cdcore import Body, Verdict, create_detector
from cdcore.bounding.bounding_sphere import sphere_best, sphere_by_triangle_mean
from cdcore.narrow.fcl_meshes import FclMeshes
from cdcore.protocol import counts_as_contact

BALLS = [Body("a", ball_mesh()), Body("b", ball_mesh())]
"""Of radius 1 m."""
SEPARATED_FOR_4_FRAMES = motion_at_rest(BALLS, [(0, 0, 0), (5, 0, 0)], frames=4)
"""5 m from each other."""


@pytest.mark.parametrize("name", ["aabb", "solid-style"])
def test_distant_spheres_are_cleared_without_testing_trees(name):
    """Two balls of radius 1 m, 5 m apart: no node of a tree is tested in four frames."""
    detection = create_detector(name, BALLS).detect(SEPARATED_FOR_4_FRAMES)
    assert detection.verdict.tolist() == 4 * [[Verdict.CLEAR]]
    assert detection.work["node_tests"] == 0


def test_spheres_are_tested_once_a_frame():
    """Two balls of radius 1 m, 5 m apart, are a pair: four tests in four frames."""
    assert create_detector("aabb", BALLS).detect(SEPARATED_FOR_4_FRAMES).work["sphere_tests"] == 4


def test_obb_tests_distant_bodies_at_rest_only_once():
    """Two balls 5 m apart; the first of 4 frames queries the trees, whose roots are apart; three reuse its answer."""
    work = create_detector("obb", BALLS).detect(SEPARATED_FOR_4_FRAMES).work
    assert (work["tree_queries"], work["reused"]) == (1, 3)
    assert (work["node_tests"], work["leaf_tests"]) == (1, 0)


def test_image_space_detector_has_no_false_contact():
    """40 frames of a laboratory, against ``exact``; depth images of limited resolution may miss up to 20 % of contacts.

    INVALID, where meshes are open, and NO_POSE decide nothing.
    """
    bodies, motion = lab_bodies_and_motion(frames=40)
    truth = counts_as_contact(create_detector("exact", bodies).detect(motion).verdict)
    detection = create_detector("image-space", bodies).detect(motion)
    answer = counts_as_contact(detection.verdict)
    assert detection.approximate
    assert not (answer & ~truth).any()
    decided = ~np.isin(detection.verdict, [Verdict.INVALID, Verdict.NO_POSE])
    assert (truth & decided).any()
    assert answer.sum() > 0.8 * (truth & decided).sum()


@pytest.mark.parametrize(
    ("x", "verdict", "reasons"),
    [
        pytest.param(1.0, Verdict.INVALID, {(0, 0): "bowl is open: it has no inside to overlap"}, id="boxes overlap"),
        pytest.param(1.6, Verdict.CLEAR, {}, id="only spheres overlap"),
        pytest.param(-1.6, Verdict.CLEAR, {}, id="only spheres overlap, on the other side"),
    ],
)
def test_open_mesh_is_invalid_only_where_boxes_overlap(x, verdict, reasons):
    """A bowl, a ball of radius 1 m that lacks nine faces, and a box of 1 m at this x, by ``image-space``.

    Their boxes overlap up to 1 + 0.5 m, their spheres up to 1 + 0.87 m.
    """
    bodies = [Body("bowl", without_faces(ball_mesh(), count=9)), Body("box", box_mesh())]
    detection = create_detector("image-space", bodies).detect(motion_at_rest(bodies, [(0, 0, 0), (x, 0, 0)]))
    assert detection.verdict.tolist() == [[verdict]]
    assert detection.reasons == reasons


@pytest.mark.parametrize(
    ("second", "x", "verdict"),
    [
        pytest.param(ball_mesh(0.2), 0.1, Verdict.CONTAINED, id="ball inside"),
        pytest.param(ball_mesh(0.2), 0.5, Verdict.CONTACT, id="ball across a side"),
        pytest.param(box_mesh(), 1.0, Verdict.NOT_FOUND, id="boxes side to side: no depth in common"),
    ],
)
def test_image_space_tells_contained_from_contact(second, x, verdict):
    """A box of 1 m, and a ball of radius 0.2 m or another such box at this x, by ``image-space``."""
    bodies = [Body("box", box_mesh()), Body("second", second)]
    detection = create_detector("image-space", bodies).detect(motion_at_rest(bodies, [(0, 0, 0), (x, 0, 0)]))
    assert detection.verdict.tolist() == [[verdict]]


def contacts_by_fcl(bodies, motion, pairs):
    """Whether FCL says contact of the meshes of every pair in every frame, without any volume in front."""
    engine = FclMeshes([body.mesh for body in bodies])
    poses = [(motion.rotations[:, k], motion.translations[:, k]) for k in range(len(bodies))]
    return np.stack([engine.at_poses(engine.touch, i, j, poses[i], poses[j]) for i, j in pairs.tolist()], axis=1)


@pytest.mark.sampled(3)
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("settings", [{}, {"containment": False}], ids=["default", "without containment"])
def test_contact_is_where_the_meshes_meet_and_nowhere_else(seed, settings):
    """Five bodies of a laboratory in 200 frames: ``hybrid`` says CONTACT where FCL, asked about the meshes, does."""
    bodies, motion = lab_bodies_and_motion(frames=200, seed=seed, gaps=False)
    detection = create_detector("hybrid", bodies, **settings).detect(motion)
    expected = contacts_by_fcl(bodies, motion, detection.pairs)
    assert expected.any()
    assert np.array_equal(detection.verdict == Verdict.CONTACT, expected)


def test_still_frames_take_a_single_query_per_pair():
    """A rod of radius 0.3 cm, 3.7 cm from the middle of a glass, crosses its wall, 3.8 to 4 cm from there.

    It stays for 500 frames: one query of meshes, 499 answers reused.
    """
    bodies = [Body("glass", beaker_mesh()), Body("rod", rod_mesh())]
    in_the_wall = [0.037, 0, 0.05]
    motion = motion_at_rest(bodies, [[0, 0, 0], in_the_wall], frames=500)
    detection = create_detector("hybrid", bodies).detect(motion)
    assert (detection.verdict == Verdict.CONTACT).all()
    assert detection.work["mesh_queries"] == 1
    assert detection.work["reused"] == 499


def test_sections_exist_for_every_contact():
    """Every ninth contact in a laboratory has a section, the segments in which surfaces cross, and they are finite.

    There is at most one for each pair of faces that meets.
    """
    bodies, motion = lab_bodies_and_motion(frames=150)
    detection = create_detector("hybrid", bodies).detect(motion, faces=True)
    contacts = np.argwhere(detection.verdict == Verdict.CONTACT).tolist()
    assert len(contacts) > 9
    for frame, pair in contacts[::9]:
        segments = detection.section(frame, pair)
        assert 0 < len(segments) <= detection.face_counts[frame, pair], (frame, pair)
        assert np.isfinite(segments).all(), (frame, pair)


@pytest.mark.parametrize(("mode", "most_faces"), [("all", np.inf), ("first", 1)])
def test_first_contact_mode_stops_at_its_first_pair_of_faces(mode, most_faces):
    """40 frames of a laboratory, by ``rapid-style``: in mode all it lists as many pairs of faces that meet as
    ``exact``, in mode first at most one of a contact.
    """
    bodies, motion = lab_bodies_and_motion(frames=40)
    all_counts = create_detector("exact", bodies).detect(motion, faces=True).face_counts
    counts = create_detector("rapid-style", bodies, mode=mode).detect(motion, faces=True).face_counts
    assert all_counts.max() > 1
    assert np.array_equal(counts, np.minimum(all_counts, most_faces))


@pytest.mark.parametrize(
    ("mode", "sphere_of"), [("paper", sphere_by_triangle_mean), ("best", sphere_best)], ids=["paper", "best"]
)
@pytest.mark.parametrize(
    ("gap_m", "verdict"),
    [
        pytest.param(-1e-6, Verdict.CANDIDATE, id="overlap by 1 um"),
        pytest.param(0.0, Verdict.CANDIDATE, id="touch"),
        pytest.param(1e-6, Verdict.CLEAR, id="1 um apart"),
    ],
)
def test_pairs_are_candidates_up_to_the_radius_sum(mode, sphere_of, gap_m, verdict):
    """A ball and a beaker stand so that their bounding spheres have this gap along x.

    Spheres are those of the paper, about the mean of all corners, or the best known.
    """
    bodies = [Body("a", ball_mesh(0.5)), Body("b", beaker_mesh())]
    ball, beaker = (sphere_of(body.mesh) for body in bodies)
    offset = ball.centre - beaker.centre + [ball.radius + beaker.radius + gap_m, 0, 0]
    motion = motion_at_rest(bodies, [[0, 0, 0], offset])
    assert create_detector("sphere", bodies, sphere=mode).detect(motion).verdict.tolist() == [[verdict]]
