"""Under every setting a search among three boxes finds true pairs, alike live and traced; misses are explained.

The worlds are so small that their kernels can also run as Python: ``.ci/branch_coverage.py`` measures them so.
"""

import numpy as np
import pytest
from support.search_scenes import I3, NO_SEEDS, ball_of, exact_pairs, search_of
from support.shapes import box_mesh

from cdcore import Body, Motion, Verdict, create_detector
from cdcore.protocol import detect_live
from cdcore.search.search_settings import EQUATIONS, VARIANTS

AT_ORIGIN = (I3, np.zeros(3))
SETTINGS = [
    *({"variant": variant} for variant in VARIANTS),
    *({"without_equation": equation, "restart_after": 40} for equation in EQUATIONS),
    {"samples": 12},
    {"rest": 0.5},
    {"stop_first": False},
    {"warm_start": False},
]


def face_pairs(detection, frame, pair):
    """The face pairs that a detection lists, as a set."""
    return {tuple(row) for row in detection.faces(frame, pair).tolist()}


@pytest.fixture(scope="module")
def three_boxes():
    """Three boxes, the third without a pose in the last frame; overlap, the same again, a touch, a gap, nested, far."""
    bodies = [Body(name, box_mesh()) for name in "abc"]
    positions = np.zeros((6, 3, 3))
    positions[:, 1] = [
        [0.9, 0.1, 0.2],
        [0.9, 0.1, 0.2],
        [1.0, 0.0, 0.0],
        [1.01, 0.0, 0.0],
        [0.4, 0.3, 0.2],
        [9.0, 0, 0],
    ]
    positions[:, 2, 1] = [0.8, 0.8, 0.8, 0.801, 3.0, 3.0]
    valid = np.ones((6, 3), dtype=bool)
    valid[-1, 2] = False
    motion = Motion(np.arange(6.0), positions, np.broadcast_to(np.eye(3), (6, 3, 3, 3)), valid)
    return bodies, motion, create_detector("exact", bodies).detect(motion, faces=True)


@pytest.mark.sampled(15)
@pytest.mark.parametrize("settings", SETTINGS, ids=str)
def test_ant_search_offline_live_and_traced_agree(settings, three_boxes):
    """Three boxes overlap in some of six frames; the ant colony (qaco) searches their triangles for a pair that meets.

    Its faces must be among those of the exhaustive test; a frame at a time and step by step it must say the same.
    """
    bodies, motion, exact = three_boxes
    detector = create_detector("qaco", bodies, budget=100, **settings)
    offline, watched = detector.detect(motion, faces=True), detector.watch(motion)
    contact = offline.verdict == Verdict.CONTACT
    assert settings.get("samples") or contact.any()  # 12 samples of the triangles may miss every contact
    for frame, pair in np.argwhere(contact).tolist():
        assert face_pairs(offline, frame, pair) <= face_pairs(exact, frame, pair)
    assert np.array_equal(detect_live(detector, motion).verdict == Verdict.CONTACT, contact)
    assert watched.search.noted
    for (frame, pair), noted in watched.search.noted.items():
        trace = watched.search.trace(motion, frame, pair)
        assert trace.result == noted.result
        improvements = trace.distance[trace.best()][:-1]
        assert (np.diff(improvements) < 0).all()  # each best candidate so far is closer than the one before
        closest_points = watched.search.points(motion, frame, pair, noted.result.closest)
        assert closest_points.shape == (2, 3)  # a point in space on each body
        assert (noted.result.hit is not None) == contact[frame, pair]


@pytest.mark.parametrize("name", ["qaco", "hybrid-qaco"])
@pytest.mark.parametrize(("settings", "sampled"), [({"samples": 1}, False), ({"budget": 1}, True)], ids=str)
def test_misses_are_explained_by_sample_or_budget(name, settings, sampled, three_boxes):
    """A sample of one face a body has no pair that meets; with all faces a budget of 1 is too small, and more is tried.

    ``sampled``: whether faces that meet are in the sample.
    """
    bodies, motion, exact = three_boxes
    detector = create_detector(name, bodies, **settings)
    missed = np.argwhere((exact.face_counts > 0) & (detector.detect(motion).verdict != Verdict.CONTACT)).tolist()
    reasons = [detector.explain(motion, frame, column, exact.faces(frame, column)) for frame, column in missed]
    assert {reason.sample_meets for reason in reasons} == {sampled}
    assert all((reason.found_with_more is not None) == sampled for reason in reasons)


@pytest.mark.parametrize("offset", [(1.0, 0.25, 0.125), (0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (0.3, 0.2, 0.1)])
def test_curve_of_a_hit_is_every_pair_of_two_boxes(offset):
    """Boxes that share a face, are equal, share a corner, or cross."""
    box, pose = box_mesh(), (I3, np.array(offset))
    search = search_of(box, box, variant="local", budget=1000)
    truth = exact_pairs(search, box, box, pose, AT_ORIGIN)
    assert search.search(pose, AT_ORIGIN, stamp=0.0).hit in truth
    assert {tuple(row) for row in search.curve(NO_SEEDS).tolist()} == truth


def test_a_curve_outgrows_its_first_memory():
    """A ball of 32 faces on itself has more meeting pairs than the 256 that fit at first."""
    ball = ball_of(faces=32)
    search = search_of(ball, ball)
    truth = exact_pairs(search, ball, ball, AT_ORIGIN, AT_ORIGIN)
    assert len(truth) > 256
    assert search.search(AT_ORIGIN, AT_ORIGIN, stamp=0.0).hit is not None
    assert {tuple(row) for row in search.curve(NO_SEEDS).tolist()} == truth
