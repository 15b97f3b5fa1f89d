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
    """Misses of these frames by a detector that explains nothing, examined, and how many frames were queried at a time.

    Evidence and cause come from the same queries: a second one of the same frames would be seen here.
    """
    frames_per_query = []

    def detect(motion):
        frames_per_query.append(len(motion))
        return detector.detect(motion, faces=True)

    whole = replace(detector.detect(assembly.motion), covers="intervals" if between else "instants")
    subjects = {"it": Audited(assembly.motion, object(), whole, whole)}
    misses = {"it": [miss(*segment) for segment in segments]}
    examined = sorted(
        examined_misses(assembly, detect, misses, subjects, reference_is_of_intervals=between),
        key=lambda entry: entry[1],
    )
    assert all(causes and fault.cause in causes for _, _, fault, causes in examined)
    return [fault for _, _, fault, _ in examined], frames_per_query


def measured_cuts(session, segments):
    """Misses of these (pair, first, last frame), measured, and how many frames were queried at a time."""
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

    Its intersection curve (``metres``) is the longest in frame 2 of frames 0 to 4, in frame 1 of frames 0 to 1.
    """
    session = offset_cubes([0.68, 0.6, 0.5, 0.6, 0.68])
    (whole, beginning), frames_per_query = measured_cuts(session, [(0, 0, 4), (0, 0, 1)])
    assert whole.frame == 2 and beginning.frame == 1
    assert whole.metres > beginning.metres > 0.0
    assert beginning.evidence.face_pairs > 0
    assert beginning.point[0] == pytest.approx(0.5, abs=1e-12)
    assert beginning.evidence.normal[0] == pytest.approx(1.0, abs=1e-9)
    assert frames_per_query == [5], "the frames of both misses are queried once"


def test_a_contained_body_has_a_point_and_no_curve():
    """A cube of 0.1 m is inside one of 1 m; the point is midway between their centres, at x = 5 and 4.8 m."""
    poses, meshes = {"a": along_x([5, 5]), "b": along_x([4.8, 4.9])}, {"a": cube(), "b": cube(edge=0.1)}
    (cut,), _ = measured_cuts(Session.from_arrays([0, 1], poses, meshes), [(0, 0, 1)])
    assert (cut.frame, cut.metres, cut.evidence.face_pairs) == (0, 0.0, 0)
    assert cut.point == pytest.approx((4.9, 0, 0)) and cut.evidence.normal == pytest.approx((-1, 0, 0))


def test_long_misses_are_sampled_evenly_with_both_ends():
    """All frames where they are few, the middle if one is allowed, else steps that differ by a frame at most."""
    assert spread_frames(first=3, last=9, most_frames=10).tolist() == list(range(3, 10))
    assert spread_frames(first=4, last=10, most_frames=1).tolist() == [7]
    many = spread_frames(first=0, last=10_000, most_frames=EVIDENCE_BUDGET.per_miss)
    assert (len(many), many[0], many[-1]) == (EVIDENCE_BUDGET.per_miss, 0, 10_000) and np.ptp(np.diff(many)) <= 1


def test_groups_keep_the_order_and_their_limit():
    """Sizes add up to at most 6 in a group; a larger one is alone."""
    assert [*grouped_by_size([3, 4, 2, 9, 1, 1, 5], size=int, most_size=6)] == [[3], [4, 2], [9], [1, 1], [5]]


@pytest.mark.parametrize(
    ("other", "normal"),
    [
        # The other triangle stands across the first, in a plane through X: they cut along X.
        ([[0.1, -1, 0.5], [0.9, -1, 0.5], [0.5, 2, 0.5]], (0, 0.5**0.5, 0.5**0.5)),
        # The middles lie along the line: any normal across it would be as good, and the way between them is kept.
        ([[-1, -1, 0.0], [2.6, -1, 0.0], [0.8, 1, 0.0]], (1, 0, 0)),
    ],
)
def test_normal_of_a_straight_cut_is_perpendicular_to_the_cut(other, normal):
    """A triangle in the plane y = 0 is cut along X. The normal is the way to the middle of ``b`` less its part along X.

    Middles are those of bounding boxes. Frame 0 alone is missed; in frame 1 ``b`` is 9 m away.
    """
    flat = MeshData(np.array([[0.0, 0, -1], [1, 0, -1], [0.5, 0, 1]]), np.array([[0, 1, 2]]))
    across = MeshData(np.array(other, dtype=float), np.array([[0, 1, 2]]))
    poses = {"a": along_x([0, 0]), "b": along_x([0.05, 9])}
    (cut,), _ = measured_cuts(Session.from_arrays([0, 1], poses, {"a": flat, "b": across}), [(0, 0, 0)])
    assert cut.evidence.face_pairs == 1 and cut.metres > 0.0
    assert cut.evidence.normal == pytest.approx(normal, abs=1e-9)


def test_a_curve_is_as_long_as_its_segments():
    """Three triangles cut a floor in -10 to -6, -6 to -5 and -5 to -4 m: 6 m, whose middle is at -7 m.

    The middle of the first segment, -8 m, is the nearest to that.
    """
    corners = [[(c - long, 0, -1), (c + long, 0, -1), (c, 0, 1)] for c, long in ((2, 4), (4.5, 1), (5.5, 1))]
    wall = MeshData(np.reshape(corners, (-1, 3)).astype(float), np.arange(9).reshape(-1, 3))
    floor = MeshData(np.array([[-20.0, -5, 0], [20, -5, 0], [0, 20, 0]]), np.array([[0, 1, 2]]))
    poses = {"a": along_x([-10, -10]), "b": along_x([0, 1])}
    (cut,), _ = measured_cuts(Session.from_arrays([0, 1], poses, {"a": wall, "b": floor}), [(0, 0, 0)])
    assert cut.evidence.face_pairs == 3 and cut.metres == pytest.approx(6.0) and cut.point == pytest.approx((-8, 0, 0))


def misses_between_frames(positions, *segments):
    """Measured misses (pair, first, last) of cube b, at these places on X, which flies through cube a at the origin."""
    session = unit_cubes_on_x({"a": [0.0] * len(positions), "b": positions})
    assembly = assemble(session)
    exact = create_detector("exact", assembly.bodies, pairs=assembly.pairs)
    return measured_misses(assembly, exact, segments, between=True)[0]


def test_a_contact_between_frames_has_moment_faces_and_point():
    """Frames 10 ms apart: b flies from x = 3 m to -3 m in frame 1 to 2 and touches at x = 1 m, after a third of it."""
    (cut,) = misses_between_frames([3.0, 3.0, -3.0, -3.0], (0, 2, 2))
    assert cut.evidence.touch.moment == pytest.approx(0.01 + 0.01 * 2 / 6, abs=1e-6)
    assert (cut.frame, cut.evidence.face_pairs, cut.evidence.faces.tolist()) == (2, 1, [list(cut.evidence.touch.faces)])
    assert (cut.point, cut.evidence.normal) == (cut.evidence.touch.point, cut.evidence.touch.normal)
    assert cut.point[0] == pytest.approx(0.5, abs=1e-3)


@pytest.mark.parametrize(("position", "faces"), [(0.8, True), (2.0, False)])
def test_frame_with_visible_contact_is_measured(position, faces):
    """``position``: x of b in frame 2. At 0.8 m the unit cubes' faces meet; at 2 m none, and the point is midway."""
    (cut,) = misses_between_frames([3.0, 3.0, position, 3.0], (0, 2, 2))
    assert (
        cut.evidence.touch is None
        and cut.evidence.face_pairs == len(cut.evidence.faces)
        and (cut.evidence.face_pairs > 1) == (cut.metres > 0) == faces
    )
    assert faces or cut.point == pytest.approx((1.0, 0, 0))


def test_first_touch_is_computed_for_a_limited_number_of_faults(monkeypatch):
    """A cube flies through another before frame 2 and back before frame 4; only one touch may be computed."""
    monkeypatch.setattr("replay.auditing.evidence.MOST_LOCATED_TOUCHES", 1)
    first, second = misses_between_frames([3.0, 3.0, -3.0, -3.0, 3.0], (0, 2, 2), (0, 4, 4))
    assert first.evidence.touch is not None and second.evidence.touch is None


def test_fault_begins_at_its_first_touch_between_frames():
    """Frames 4 to 6, of 10 ms; the bodies first touch 2 ms after frame 3, and 1 ms before they were free.

    ``moment``: a frame and nanoseconds after it; ``begin_within``: a second, and by how much it is uncertain.
    """
    of_frames = miss(0, first=4, last=6, start=0.04)
    touch = FirstTouch(
        3, free=0.031, moment=0.032, later_ns=2_000_000, faces=(0, 0), point=(0.0,) * 3, normal=(0.0,) * 3
    )
    between_frames = replace(of_frames, evidence=Evidence(touch=touch))
    assert of_frames.frames == 3
    assert of_frames.moment == (4, 0) and of_frames.begin_within == (0.04, 0.0)
    assert between_frames.moment == (3, 2_000_000)
    assert between_frames.begin_within == pytest.approx((0.032, 0.001))
