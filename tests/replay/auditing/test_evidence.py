from dataclasses import replace

import numpy as np
import pytest
from support.small_worlds import along_x, cube, unit_cubes_on_x

from cdcore import create_detector
from replay.auditing.causes import Audited
from replay.auditing.examination import EVIDENCE_BUDGET, examined_misses
from replay.auditing.fault import Evidence, Fault, FaultKind
from replay.auditing.outcome import FirstTouch
from replay.auditing.sample_budget import grouped_by_size, spread_frames
from replay.prepare.assemble import assemble
from sessions import MeshData, Session


def miss(pair, first, last, start=0.0):
    """A miss of these frames, which begins at ``start`` seconds, that is not yet measured."""
    return Fault(
        number=1,
        detector="it",
        pair=pair,
        bodies=("a", "b"),
        kind=FaultKind.NEVER_REPORTED,
        first=first,
        last=last,
        start=start,
        end=1.0,
        frame=first,
    )


def measured_misses(assembly, detector, segments, *, between=False):
    """Misses of pair 0 in these (first, last) frames, measured, and how many frames each query of the detector had.

    ``between``: the detector is one of intervals. Every miss gets a cause, which needs no query of its own.
    """
    frames_per_query = []

    def detect(motion):
        frames_per_query.append(len(motion))
        return detector.detect(motion, faces=True)

    whole = replace(detector.detect(assembly.motion), covers="intervals" if between else "instants")
    subjects = {"it": Audited(assembly.motion, object(), whole, whole)}
    misses = {"it": [miss(pair=0, first=first, last=last) for first, last in segments]}
    examined = sorted(
        examined_misses(assembly, detect, misses, subjects, reference_is_of_intervals=between),
        key=lambda entry: entry[1],
    )
    assert all(causes and fault.cause in causes for _, _, fault, causes in examined)
    return [fault for _, _, fault, _ in examined], frames_per_query


def measured_cuts(session, segments):
    """Misses of the only pair in these (first, last) frames, measured, and how many frames each query had."""
    assembly = assemble(session)
    return measured_misses(assembly, create_detector("hybrid", assembly.bodies, pairs=assembly.pairs), segments)


def offset_cubes(positions):
    """A cube of 1 m at the origin and one of 0.3 m, turned and shifted so that faces cross in general position."""
    rotation = np.tile(np.array([0.1, 0.2, 0.3, 0.9]) / np.sqrt(0.95), (len(positions), 1))
    moving = along_x(positions)[0] + [0, 0.13, 0.21]
    return Session.from_arrays(
        np.arange(len(positions)) * 10_000_000,
        {"a": along_x([0] * len(positions)), "b": (moving, rotation)},
        {"a": cube(), "b": cube(edge=0.3)},
    )


def test_the_longest_curve_has_a_normal_toward_the_second_body():
    """Small cube b crosses a's face at x = 0.5 m, half of it in frame 2 and less before and after.

    The curve in which the surfaces cross (``metres``) is the longest in frame 2 of frames 0 to 4, in frame 1 of frames
    0 to 1. Its point is on that face, the normal points along x to b; frames of both misses are queried once.
    """
    session = offset_cubes([0.68, 0.6, 0.5, 0.6, 0.68])
    (whole, beginning), frames_per_query = measured_cuts(session, segments=[(0, 4), (0, 1)])
    assert whole.frame == 2 and beginning.frame == 1
    assert whole.metres > beginning.metres > 0.0
    assert beginning.evidence.face_pairs > 0
    assert beginning.point[0] == pytest.approx(0.5, abs=1e-12)
    assert beginning.evidence.normal[0] == pytest.approx(1.0, abs=1e-9)
    assert frames_per_query == [5]


def test_a_contained_body_has_a_point_and_no_curve():
    """A cube of 0.1 m is inside one of 1 m: no faces meet, and the first of the frames, 0, is taken.

    The point is midway between the centres at x = 5 and 4.8 m; the normal points from the first to the second.
    """
    poses, meshes = {"a": along_x([5, 5]), "b": along_x([4.8, 4.9])}, {"a": cube(), "b": cube(edge=0.1)}
    (contained,), _ = measured_cuts(Session.from_arrays([0, 1], poses, meshes), segments=[(0, 1)])
    assert (contained.frame, contained.metres, contained.evidence.face_pairs) == (0, 0.0, 0)
    assert contained.point == pytest.approx((4.9, 0, 0))
    assert contained.evidence.normal == pytest.approx((-1, 0, 0))


@pytest.mark.parametrize(
    ("first", "last", "most_frames", "frames"),
    [
        pytest.param(3, 9, 10, [3, 4, 5, 6, 7, 8, 9], id="all where they are few"),
        pytest.param(4, 10, 1, [7], id="the middle if one is allowed"),
        pytest.param(0, 20, 5, [0, 5, 10, 15, 20], id="even steps with both ends"),
    ],
)
def test_frames_of_a_miss_are_spread_evenly(first, last, most_frames, frames):
    """A miss from frame ``first`` to ``last``, of which at most so many frames may be queried."""
    assert spread_frames(first=first, last=last, most_frames=most_frames).tolist() == frames


def test_long_misses_are_sampled_evenly_with_both_ends():
    """A miss has 10,001 frames: as many are queried as are allowed, with both ends; steps differ by one frame."""
    frames = spread_frames(first=0, last=10_000, most_frames=EVIDENCE_BUDGET.per_miss)
    assert len(frames) == EVIDENCE_BUDGET.per_miss
    assert (frames[0], frames[-1]) == (0, 10_000)
    assert np.ptp(np.diff(frames)) <= 1


def test_groups_keep_the_order_and_their_limit():
    """Numbers are their own size here; sizes add up to at most 6 in a group, and a larger one is alone."""
    groups = [*grouped_by_size([3, 4, 2, 9, 1, 1, 5], size=int, most_size=6)]
    assert groups == [[3], [4, 2], [9], [1, 1], [5]]


@pytest.mark.parametrize(
    ("corners_of_b", "normal"),
    [
        # From the middle of a, (0.5, 0, 0), to that of b, (0.55, 0.5, 0.5): less its part along X, (0, 0.5, 0.5).
        pytest.param([[0.1, -1, 0.5], [0.9, -1, 0.5], [0.5, 2, 0.5]], (0, 0.5**0.5, 0.5**0.5), id="across"),
        # From (0.5, 0, 0) to (0.85, 0, 0): nothing but X, any normal across it would be as good, and X is kept.
        pytest.param([[-1, -1, 0.0], [2.6, -1, 0.0], [0.8, 1, 0.0]], (1, 0, 0), id="middles along the cut"),
    ],
)
def test_normal_of_a_straight_cut_is_perpendicular_to_the_cut(corners_of_b, normal):
    """Triangle a, in the plane y = 0, is cut along X by triangle b, in a plane of constant z, shifted by 0.05 m in x.

    The normal is the way from the middle of a's bounding box to that of b's, less its part along the cut.
    """
    a = MeshData(np.array([[0.0, 0, -1], [1, 0, -1], [0.5, 0, 1]]), np.array([[0, 1, 2]]))
    b = MeshData(np.array(corners_of_b, dtype=float), np.array([[0, 1, 2]]))
    far_away = 9.0
    poses = {"a": along_x([0, 0]), "b": along_x([0.05, far_away])}
    (cut,), _ = measured_cuts(Session.from_arrays([0, 1], poses, {"a": a, "b": b}), segments=[(0, 0)])
    assert cut.evidence.face_pairs == 1 and cut.metres > 0.0
    assert cut.evidence.normal == pytest.approx(normal, abs=1e-9)


def test_a_curve_is_as_long_as_its_segments():
    """Three upright triangles cut a floor along x from -10 to -6, -6 to -5 and -5 to -4 m: 6 m, its middle at -7 m.

    The middles of the segments are -8, -5.5 and -4.5 m; the nearest to -7 m is the point of the curve.
    """
    wall_x = -10.0
    segments = [(-10.0, -6.0), (-6.0, -5.0), (-5.0, -4.0)]
    corners = []
    for start, end in segments:
        # At half its height, z = 0, a triangle is half as wide as at its foot.
        middle, width = (start + end) / 2 - wall_x, end - start
        corners += [(middle - width, 0, -1), (middle + width, 0, -1), (middle, 0, 1)]
    wall = MeshData(np.array(corners, dtype=float), np.arange(9).reshape(-1, 3))
    floor = MeshData(np.array([[-20.0, -5, 0], [20, -5, 0], [0, 20, 0]]), np.array([[0, 1, 2]]))
    poses = {"a": along_x([wall_x, wall_x]), "b": along_x([0, 1])}
    (cut,), _ = measured_cuts(Session.from_arrays([0, 1], poses, {"a": wall, "b": floor}), segments=[(0, 0)])
    assert cut.evidence.face_pairs == 3
    assert cut.metres == pytest.approx(6.0)
    assert cut.point == pytest.approx((-8, 0, 0))


def misses_between_frames(positions, *missed_frames):
    """Measured misses, of a frame each, of a reference that tests the way between frames, 10 ms apart.

    Unit cube b is at these places on x, cube a at the origin: they touch from x = 1 m down.
    """
    session = unit_cubes_on_x({"a": [0.0] * len(positions), "b": positions})
    assembly = assemble(session)
    exact = create_detector("exact", assembly.bodies, pairs=assembly.pairs)
    return measured_misses(assembly, exact, [(frame, frame) for frame in missed_frames], between=True)[0]


def test_a_contact_between_frames_has_moment_faces_and_point():
    """b flies from x = 3 m to -3 m between frames 1 and 2, 10 ms, and touches a at x = 1 m, after a third of it.

    The evidence in frame 2 is that of the first touch: its two faces, its point at a's face x = 0.5 m, its normal.
    """
    (cut,) = misses_between_frames([3.0, 3.0, -3.0, -3.0], 2)
    touch = cut.evidence.touch
    assert touch.moment == pytest.approx(0.01 + 0.01 / 3, abs=1e-6)
    assert cut.frame == 2
    assert (cut.evidence.face_pairs, cut.evidence.faces.tolist()) == (1, [list(touch.faces)])
    assert (cut.point, cut.evidence.normal) == (touch.point, touch.normal)
    assert cut.point[0] == pytest.approx(0.5, abs=1e-3)


@pytest.mark.parametrize(
    ("position", "faces_meet"), [pytest.param(0.8, True, id="in contact"), pytest.param(2.0, False, id="apart")]
)
def test_miss_without_a_jump_is_measured_at_its_frame(position, faces_meet):
    """Unit cube b goes from x = 3 m to ``position`` in frame 2 and back: the frame is measured, no moment before it.

    At 0.8 m faces meet, in a curve; at 2 m none do, and the point is midway between the centres, at x = 1 m.
    """
    (cut,) = misses_between_frames([3.0, 3.0, position, 3.0], 2)
    assert cut.evidence.touch is None
    assert cut.evidence.face_pairs == len(cut.evidence.faces)
    assert (cut.evidence.face_pairs > 1) == (cut.metres > 0) == faces_meet
    assert faces_meet or cut.point == pytest.approx((1.0, 0, 0))


def test_first_touch_is_computed_for_a_limited_number_of_faults(monkeypatch):
    """A cube flies through another before frame 2 and back before frame 4, both missed; only one touch is computed."""
    monkeypatch.setattr("replay.auditing.evidence.MOST_LOCATED_TOUCHES", 1)
    first, second = misses_between_frames([3.0, 3.0, -3.0, -3.0, 3.0], 2, 4)
    assert first.evidence.touch is not None and second.evidence.touch is None


def test_fault_begins_at_its_first_touch_between_frames():
    """A miss of frames 4 to 6, 10 ms each; its bodies touch 2 ms after frame 3, and 1 ms earlier they were apart.

    ``moment``: a frame and nanoseconds after it. ``begin_within``: seconds of the begin, and of its uncertainty.
    """
    of_frames = miss(pair=0, first=4, last=6, start=0.04)
    touch = FirstTouch(
        frame=3,
        free=0.031,
        moment=0.032,
        later_ns=2_000_000,
        faces=(0, 0),
        point=(0.0, 0.0, 0.0),
        normal=(0.0, 0.0, 0.0),
    )
    between_frames = replace(of_frames, evidence=Evidence(touch=touch))
    assert of_frames.frames == between_frames.frames == 3
    assert of_frames.moment == (4, 0) and of_frames.begin_within == (0.04, 0.0)
    assert between_frames.moment == (3, 2_000_000)
    assert between_frames.begin_within == pytest.approx((0.032, 0.001))
