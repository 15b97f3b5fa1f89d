"""Under every setting a search among three boxes finds pairs of faces that meet, alike live and traced.

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
    """Three boxes of 1 m in six frames, the motion, and the answer of ``exact`` with faces.

    The third has no pose in the last frame.
    """
    bodies = [Body(name, box_mesh()) for name in "abc"]
    positions = np.zeros((6, 3, 3))
    positions[:, 1] = [
        [0.9, 0.1, 0.2],  # overlap
        [0.9, 0.1, 0.2],  # the same again
        [1.0, 0.0, 0.0],  # touch
        [1.01, 0.0, 0.0],  # 1 cm apart
        [0.4, 0.3, 0.2],  # deep in each other
        [9.0, 0, 0],  # far apart
    ]
    positions[:, 2, 1] = [0.8, 0.8, 0.8, 0.801, 3.0, 3.0]
    valid = np.ones((6, 3), dtype=bool)
    valid[-1, 2] = False
    motion = Motion(np.arange(6.0), positions, np.broadcast_to(np.eye(3), (6, 3, 3, 3)), valid)
    return bodies, motion, create_detector("exact", bodies).detect(motion, faces=True)


@pytest.mark.sampled(15)
@pytest.mark.parametrize("settings", SETTINGS, ids=str)
def test_ant_search_hits_offline_and_live_are_true(settings, three_boxes):
    """Three boxes overlap in some of six frames; the ant colony (qaco) searches their triangles for a pair that meets.

    Its faces must be among those of ``exact``, and frame by frame (live) it must say contact in the same frames.
    12 samples of the triangles may miss every contact.
    """
    bodies, motion, exact = three_boxes
    detector = create_detector("qaco", bodies, budget=100, **settings)
    offline = detector.detect(motion, faces=True)
    contact = offline.verdict == Verdict.CONTACT
    assert settings.get("samples") or contact.any()
    for frame, pair in np.argwhere(contact).tolist():
        assert face_pairs(offline, frame, pair) <= face_pairs(exact, frame, pair), (frame, pair)
    assert np.array_equal(detect_live(detector, motion).verdict == Verdict.CONTACT, contact)


@pytest.mark.sampled(15)
@pytest.mark.parametrize("settings", SETTINGS, ids=str)
def test_traced_ant_search_is_that_of_the_detector(settings, three_boxes):
    """``watch`` notes every search of a motion, and ``trace`` runs one again, step by step: with the same result.

    It hits where the detector says contact; each best pair of faces so far is closer than the one before, and has a
    point in space on each body.
    """
    bodies, motion, _exact = three_boxes
    detector = create_detector("qaco", bodies, budget=100, **settings)
    contact = detector.detect(motion).verdict == Verdict.CONTACT
    search = detector.watch(motion).search
    assert search.noted
    for (frame, pair), noted in search.noted.items():
        assert (noted.result.hit is not None) == contact[frame, pair], (frame, pair)
        trace = search.trace(motion, frame, pair)
        assert trace.result == noted.result, (frame, pair)
        improvements = trace.distance[trace.best()][:-1]
        assert (np.diff(improvements) < 0).all(), (frame, pair)
        assert search.points(motion, frame, pair, noted.result.closest).shape == (2, 3), (frame, pair)


@pytest.mark.parametrize("name", ["qaco", "hybrid-qaco"])
@pytest.mark.parametrize(
    ("settings", "sample_meets"),
    [
        pytest.param({"samples": 1}, False, id="one face a body is searched"),
        pytest.param({"budget": 1}, True, id="one evaluation"),
    ],
)
def test_misses_are_explained_by_sample_or_budget(name, settings, sample_meets, three_boxes):
    """Contacts of three boxes that a search misses: a sample of one face a body has no pair of faces that meets.

    With all faces a budget of one evaluation is too small, and more is tried: ``found_with_more``.
    """
    bodies, motion, exact = three_boxes
    detector = create_detector(name, bodies, **settings)
    missed = np.argwhere((exact.face_counts > 0) & (detector.detect(motion).verdict != Verdict.CONTACT)).tolist()
    explanations = [detector.explain(motion, frame, pair, exact.faces(frame, pair)) for frame, pair in missed]
    assert {explanation.sample_meets for explanation in explanations} == {sample_meets}
    assert {explanation.found_with_more is not None for explanation in explanations} == {sample_meets}


@pytest.mark.parametrize(
    "offset",
    [
        pytest.param((1.0, 0.25, 0.125), id="share part of a face"),
        pytest.param((0.0, 0.0, 0.0), id="equal"),
        pytest.param((1.0, 1.0, 1.0), id="share a corner"),
        pytest.param((0.3, 0.2, 0.1), id="cross"),
    ],
)
def test_curve_of_a_hit_is_every_pair_of_two_boxes(offset):
    """Two boxes of 1 m at an offset; a curve is the face pairs that meet and hang together with a hit, neighbour by
    neighbour.

    From the hit of a search alone, without seeds of a frame before, it is every pair that meets.
    """
    box, pose = box_mesh(), (I3, np.array(offset))
    search = search_of(box, box, variant="local", budget=1000)
    meeting = exact_pairs(search, box, box, pose, AT_ORIGIN)
    assert search.search(pose, AT_ORIGIN, stamp=0.0).hit in meeting
    assert {tuple(row) for row in search.curve(NO_SEEDS).tolist()} == meeting


def test_a_curve_outgrows_its_first_memory():
    """A ball of 32 faces on itself has more face pairs that meet than the 256 that fit at first: the curve has all."""
    ball = ball_of(faces=32)
    search = search_of(ball, ball)
    meeting = exact_pairs(search, ball, ball, AT_ORIGIN, AT_ORIGIN)
    assert len(meeting) > 256
    assert search.search(AT_ORIGIN, AT_ORIGIN, stamp=0.0).hit is not None
    assert {tuple(row) for row in search.curve(NO_SEEDS).tolist()} == meeting
