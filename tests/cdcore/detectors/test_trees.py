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
SEPARATED_FOR_4_FRAMES = motion_at_rest(BALLS, [(0, 0, 0), (5, 0, 0)], frames=4)


def test_distant_spheres_are_cleared_without_testing_trees():
    """Bodies are far apart: counters of work show that no node of a tree was tested."""
    spheres = create_detector("aabb", BALLS).detect(SEPARATED_FOR_4_FRAMES)
    assert (spheres.verdict == Verdict.CLEAR).all()
    assert spheres.work["sphere_tests"] == 4
    assert spheres.work["node_tests"] == 0
    sweep = create_detector("solid-style", BALLS).detect(SEPARATED_FOR_4_FRAMES)
    assert (sweep.verdict == Verdict.CLEAR).all()
    assert sweep.work["node_tests"] == 0


def test_obb_tests_distant_bodies_at_rest_only_once():
    """The first of 4 frames queries the trees, whose roots are apart; the three others reuse its answer."""
    work = create_detector("obb", BALLS).detect(SEPARATED_FOR_4_FRAMES).work
    assert work["tree_queries"] == 1 and work["reused"] == 3
    assert work["node_tests"] == 1 and work["leaf_tests"] == 0


def test_image_space_detector_has_no_false_contact():
    """Its pictures have a limited resolution: it may miss contacts, here fewer than 20 % of those that it decides."""
    bodies, motion = lab_bodies_and_motion(frames=40)
    truth = counts_as_contact(create_detector("exact", bodies).detect(motion).verdict)
    detection = create_detector("image-space", bodies).detect(motion)
    answer = counts_as_contact(detection.verdict)
    assert detection.approximate and not (answer & ~truth).any()
    decided = ~np.isin(detection.verdict, [Verdict.INVALID, Verdict.NO_POSE])
    assert answer.sum() > 0.8 * (truth & decided).sum() > 0


def test_open_mesh_is_invalid_only_where_boxes_overlap():
    """A bowl of radius 1 m and a box of 1 m: their boxes overlap up to 1.5 m, their spheres up to about 1.87 m."""
    bodies = [Body("bowl", without_faces(ball_mesh(), count=9)), Body("box", box_mesh())]
    near = create_detector("image-space", bodies).detect(motion_at_rest(bodies, [(0, 0, 0), (1, 0, 0)]))
    assert near.verdict.tolist() == [[Verdict.INVALID]]
    assert near.reasons == {(0, 0): "bowl is open: it has no inside to overlap"}
    for beside in (1.6, -1.6):  # where their spheres overlap
        far = create_detector("image-space", bodies).detect(motion_at_rest(bodies, [(0, 0, 0), (beside, 0, 0)]))
        assert far.verdict.tolist() == [[Verdict.CLEAR]] and far.reasons == {}


def test_ball_in_a_box_is_contained_touching_is_not():
    """A ball of 0.2 m in a box of 1 m: inside, then across its side; two boxes side to side have no common depth."""
    bodies = [Body("box", box_mesh()), Body("ball", ball_mesh(0.2))]
    detector = create_detector("image-space", bodies)
    assert detector.detect(motion_at_rest(bodies, [(0, 0, 0), (0.1, 0, 0)])).verdict.tolist() == [[Verdict.CONTAINED]]
    assert detector.detect(motion_at_rest(bodies, [(0, 0, 0), (0.5, 0, 0)])).verdict.tolist() == [[Verdict.CONTACT]]
    boxes = [Body("a", box_mesh()), Body("b", box_mesh())]
    touching = create_detector("image-space", boxes).detect(motion_at_rest(boxes, [(0, 0, 0), (1, 0, 0)]))
    assert touching.verdict.tolist() == [[Verdict.NOT_FOUND]]


def meshes_alone(bodies, motion, pairs):
    """Every pair in every frame by FCL, without any volume in front."""
    engine = FclMeshes([body.mesh for body in bodies])
    poses = [(motion.rotations[:, k], motion.translations[:, k]) for k in range(len(bodies))]
    return np.stack([engine.at_poses(engine.touch, i, j, poses[i], poses[j]) for i, j in pairs.tolist()], axis=1)


@pytest.mark.sampled(3)
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("settings", [{}, {"containment": False}])
def test_contact_is_where_the_meshes_meet_and_nowhere_else(seed, settings):
    """Truth is FCL on the meshes alone, for every pair in each of 200 frames."""
    bodies, motion = lab_bodies_and_motion(frames=200, seed=seed, gaps=False)
    detection = create_detector("hybrid", bodies, **settings).detect(motion)
    expected = meshes_alone(bodies, motion, detection.pairs)
    assert expected.any()
    assert np.array_equal(detection.verdict == Verdict.CONTACT, expected)


def test_still_frames_take_a_single_query_per_pair():
    """A rod in the wall of a glass for 500 frames: one query of meshes, 499 answers reused."""
    bodies = [Body("glass", beaker_mesh()), Body("rod", rod_mesh())]
    detection = create_detector("hybrid", bodies).detect(
        motion_at_rest(bodies, [[0, 0, 0], [0.037, 0, 0.05]], frames=500)
    )
    assert (detection.verdict == Verdict.CONTACT).all()
    assert detection.work["mesh_queries"] == 1
    assert detection.work["reused"] == 499


def test_sections_exist_for_every_contact():
    """Segments of every ninth contact: some, and at most one for each pair of faces that meets."""
    bodies, motion = lab_bodies_and_motion(frames=150)
    detection = create_detector("hybrid", bodies).detect(motion, faces=True)
    contacts = np.argwhere(detection.verdict == Verdict.CONTACT).tolist()
    assert len(contacts) > 9
    for frame, pair in contacts[::9]:
        segments = detection.section(frame, pair)
        assert 0 < len(segments) <= detection.face_counts[frame, pair]
        assert np.isfinite(segments).all()


@pytest.mark.parametrize(("mode", "most"), [("all", None), ("first", 1)])
def test_first_contact_mode_stops_at_its_first_pair_of_faces(mode, most):
    """``exact`` lists all pairs of faces; mode all lists as many, mode first at most one."""
    bodies, motion = lab_bodies_and_motion(frames=40)
    every = create_detector("exact", bodies).detect(motion, faces=True).face_counts
    counts = create_detector("rapid-style", bodies, mode=mode).detect(motion, faces=True).face_counts
    assert every.max() > 1
    assert np.array_equal(counts, np.minimum(every, most or every))


@pytest.mark.parametrize("mode", ["paper", "best"])
@pytest.mark.parametrize(
    ("gap", "verdict"), [(-1e-6, Verdict.CANDIDATE), (0.0, Verdict.CANDIDATE), (1e-6, Verdict.CLEAR)]
)
def test_pairs_are_candidates_up_to_the_radius_sum(mode, gap, verdict):
    """A ball and a beaker whose bounding spheres overlap by 1 um, touch, or are 1 um apart along x."""
    bodies = [Body("a", ball_mesh(0.5)), Body("b", beaker_mesh())]
    build = {"paper": sphere_by_triangle_mean, "best": sphere_best}[mode]
    item, other = (build(body.mesh) for body in bodies)
    offset = np.array([item.radius + other.radius + gap, 0, 0]) + item.centre - other.centre
    motion = motion_at_rest(bodies, [[0, 0, 0], offset])
    assert create_detector("sphere", bodies, sphere=mode).detect(motion).verdict[0, 0] == verdict
