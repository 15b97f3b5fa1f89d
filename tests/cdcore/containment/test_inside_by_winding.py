"""Answers inside a damaged mesh are right or UNRESOLVED, by every detector alike; boxes give the truth."""

from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.shapes import ball_mesh, box_mesh, merge_meshes, random_rotations, shift_mesh, unrotated_motion

from cdcore import Body, Motion, TriangleMesh, Verdict, create_detector
from cdcore.containment.inside_by_winding import (
    INSIDE,
    MAY_REACH,
    OUTSIDE,
    UNCERTAIN,
    UNDECIDED,
    corners_separated,
    decided_by_component,
    side_of_component,
    worse,
)
from cdcore.containment.winding_surface import winding_surface
from cdcore.protocol import detect_live

SIZE = np.array([0.2, 0.12, 0.12])
"""Metres of the block, and of a second one that crosses it."""
SHIFT = np.array([0.1, 0.03, 0.02])
PROBE_EDGE = 0.01
FRAMES = 150
DETECTORS = {
    "exact": {}, "hybrid": {}, "static": {}, "aabb": {}, "obb": {}, "rapid-style": {}, "solid-style": {},
    "collider": {"shape": "mesh"}, "hybrid-qaco": {"decide": "mesh"},
}  # fmt: skip


def reversed_faces(mesh):
    """The mesh inside out."""
    return TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])


def without_faces(mesh, *faces):
    """The mesh without the faces of these numbers."""
    return TriangleMesh(mesh.vertices, np.delete(mesh.faces, faces, axis=0))


def grid_box(size, count):
    """A box whose sides are cut into count x count squares of two triangles."""
    u = np.linspace(-0.5, 0.5, count + 1)
    points, faces = [], []
    for axis in range(3):
        for side in (-0.5, 0.5):
            first = len(points)
            for a in u:
                for b in u:
                    points.append(np.roll([side, a, b], axis) * size)
            for i in range(count):
                for j in range(count):
                    p = first + i * (count + 1) + j
                    square = [[p, p + count + 1, p + count + 2], [p, p + count + 2, p + 1]]
                    faces += square if side > 0 else [face[::-1] for face in square]
    return TriangleMesh(np.array(points), np.array(faces))


def without_a_side():
    """A block that lacks its side at x = -0.1 m, through which bodies pass without touching."""
    return without_faces(grid_box(SIZE, count=4), *range(32))  # 4 x 4 squares of two triangles


@cache
def damaged():
    """Name -> mesh, the middles of the boxes that it fills, how many lost faces it has."""
    block, other = box_mesh(SIZE), shift_mesh(box_mesh(SIZE), SHIFT)
    small = shift_mesh(box_mesh(SIZE / 2), [0.0, 0.0, 0.0])
    rows = {"sound": (block, [0 * SHIFT], 0)}
    rows |= {f"block lacks face {k}": (without_faces(block, k), [0 * SHIFT], 1) for k in range(0, 12, 3)}
    rows |= {
        f"fine block lacks face {k}": (without_faces(grid_box(SIZE, count=4), k), [0 * SHIFT], 1)
        for k in range(0, 192, 60)
    }
    rows |= {
        "every face twice": (merge_meshes(block, block), [0 * SHIFT], 0),
        "every face from both sides": (merge_meshes(block, reversed_faces(block)), [0 * SHIFT], 0),
        "one face twice": (merge_meshes(block, TriangleMesh(block.vertices, block.faces[3:4])), [0 * SHIFT], 0),
        "crossing": (merge_meshes(block, other), [0 * SHIFT, SHIFT], 0),
        "crossing, one reversed": (merge_meshes(block, reversed_faces(other)), [0 * SHIFT, SHIFT], 2),
        "nested": (merge_meshes(block, small), [0 * SHIFT], 0),
        "crossing, one lacks a face": (merge_meshes(without_faces(block, 5), other), [0 * SHIFT, SHIFT], 1),
        "lacks a face, another twice": (
            merge_meshes(without_faces(block, 2), TriangleMesh(block.vertices, block.faces[7:8])),
            [0 * SHIFT],
            1,
        ),
    }
    return rows


def overlap_of_boxes(positions, middles):
    """(T,) whether a probe overlaps any box, and whether it lies inside one of them without touching its surface."""
    overlaps, within = np.zeros(len(positions), bool), np.zeros(len(positions), bool)
    for middle in middles:
        away = np.abs(positions - middle)
        overlaps |= (away < (SIZE + PROBE_EDGE) / 2).all(axis=1)
        within |= (away < (SIZE - PROBE_EDGE) / 2).all(axis=1)
    return overlaps, within


def verdicts_of(name, mesh, positions, live=False, **settings):
    """Verdicts (T,) of a detector on a small box at these positions, beside a mesh at rest."""
    bodies = [Body("block", mesh), Body("probe", box_mesh([PROBE_EDGE] * 3))]
    motion = unrotated_motion(np.stack([0 * positions, positions], axis=1))
    detector = create_detector(name, bodies, **settings)
    return (detect_live(detector, motion) if live else detector.detect(motion)).verdict[:, 0]


@pytest.mark.sampled(34)
@pytest.mark.parametrize("name", damaged())
@pytest.mark.parametrize("wound", ["outwards", "inwards"])
def test_inside_a_damaged_mesh_is_right_or_unresolved(name, wound):
    """Small probes at random places; where faces are missing at most a tenth is undecided.

    A probe that overlaps a box which the mesh fills must not be clear; any other must be clear or undecided.
    """
    mesh, middles, lost = damaged()[name]
    mesh = reversed_faces(mesh) if wound == "inwards" else mesh
    positions = np.random.default_rng(3).uniform(-0.16, 0.26, (FRAMES, 3)) * [1.0, 0.6, 0.6]
    verdict = verdicts_of("exact", mesh, positions)
    overlaps, within = overlap_of_boxes(positions, middles)
    undecided = verdict == Verdict.UNRESOLVED
    assert not (overlaps & (verdict == Verdict.CLEAR)).any()
    assert (overlaps | (verdict == Verdict.CLEAR) | undecided).all()
    assert within.sum() > 10, "many probes are inside"
    if name.startswith(("sound", "every", "one face", "crossing", "nested")) and lost != 1:
        met = (verdict == Verdict.CONTACT) | undecided
        assert ((verdict == Verdict.CONTAINED) | met)[within].all()
    lower, upper = mesh.bounds
    beside = ((positions - PROBE_EDGE / 2 > upper) | (positions + PROBE_EDGE / 2 < lower)).any(axis=1)
    assert (verdict[beside] == Verdict.CLEAR).all()
    # Undecided is what is near a hole, and nothing of a whole mesh.
    assert undecided.mean() <= (0.1 if lost else 0.0)
    assert np.array_equal(verdicts_of("exact", mesh, positions, live=True), verdict)


@pytest.mark.sampled(2)
@pytest.mark.parametrize("detector", DETECTORS)
@pytest.mark.parametrize("live", [False, True], ids=["offline", "live"])
def test_every_detector_that_claims_containment_agrees(detector, live):
    """Probes within 3 cm of the middle of the lost side: some before the hole, some inside."""
    mesh = without_a_side()
    positions = np.array([-0.1, 0.0, 0.0]) + np.random.default_rng(4).uniform(-0.03, 0.03, (40, 3))
    expected = verdicts_of("exact", mesh, positions)
    assert {Verdict.UNRESOLVED, Verdict.CLEAR} <= {Verdict(code) for code in expected.tolist()}, (
        "in and before the hole"
    )
    assert np.array_equal(verdicts_of(detector, mesh, positions, live=live, **DETECTORS[detector]), expected)


@pytest.mark.slow
@pytest.mark.parametrize("live", [False, True], ids=["offline", "live"])
def test_slow_motion_through_a_hole_is_followed_frame_by_frame(live):
    """A body enters by the missing side, less than 1 mm a frame, and must agree with exact in every frame."""
    mesh, steps = without_a_side(), np.linspace(-0.13, 0.0, 150)
    positions = steps[:, None] * [1.0, 0.0, 0.0]
    expected = verdicts_of("exact", mesh, positions)
    assert expected[0] == Verdict.CLEAR
    assert (expected[steps > -0.1] != Verdict.CLEAR).all()
    for detector, settings in DETECTORS.items():
        assert np.array_equal(verdicts_of(detector, mesh, positions, live=live, **settings), expected), detector


def test_an_interval_through_a_hole_is_not_clear():
    """The probe is outside in frames 0, 3 and 4, and inside, past the hole, in frames 1 and 2.

    A verdict is about the path since the frame before: 1 to 3 end, stay or begin inside. Two blocks say the same.
    """
    mesh = without_a_side()
    positions = np.array([-0.2, 0.0, 0.0, -0.2, -0.2])[:, None] * [1.0, 0.0, 0.0]
    bodies = [Body("block", mesh), Body("probe", box_mesh([PROBE_EDGE] * 3))]
    motion = unrotated_motion(np.stack([0 * positions, positions], axis=1))
    answer = create_detector("continuous", bodies).detect(motion)
    assert answer.verdict[0, 0] == answer.verdict[4, 0] == Verdict.CLEAR
    assert (answer.verdict[1:4, 0] != Verdict.CLEAR).all()
    unresolved = np.argwhere(answer.verdict == Verdict.UNRESOLVED)
    assert {answer.reasons[t, p] for t, p in unresolved.tolist()} == {"inside undecided: block has holes"}
    blocks = list(create_detector("continuous", bodies).stream([motion.frames(0, 3), motion.frames(3, 5)]))
    assert np.array_equal(np.concatenate([block.verdict for block in blocks]), answer.verdict)


LOST_FACES = {"one side": range(32), "one square": (10, 11), "four squares": (10, 11, 12, 13, 18, 19, 20, 21)}


@pytest.mark.sampled(2)
@pytest.mark.parametrize("lost", LOST_FACES)
def test_arc_through_a_hole_and_back_is_not_clear(lost):
    """A bead on an arm dips into the block between two frames, at both of which it is outside.

    Truth is ``exact`` at 61 angles of the arc; ``continuous`` gets the two ends, and may leave a dip undecided.
    """
    rng = np.random.default_rng(5)
    block = Body("block", without_faces(grid_box(SIZE, count=4), *LOST_FACES[lost]))
    answer = {}
    for _ in range(16):
        arm, shift = rng.uniform(0.02, 0.05), rng.uniform(-0.035, 0.005)
        depth = rng.uniform(-0.005, 0.8 * arm - 0.005)
        bead = Body("bead", shift_mesh(box_mesh([0.004] * 3), [arm, 0.0, 0.0]))
        origin = np.array([-SIZE[0] / 2 + depth - arm, -0.015, shift])
        ends, dense = (swing(origin, np.linspace(-1.4, 1.4, count)) for count in (2, 61))
        expected = create_detector("exact", [block, bead]).detect(dense).verdict[:, 0]
        assert expected[0] == expected[-1] == Verdict.CLEAR
        verdict = create_detector("continuous", [block, bead]).detect(ends).verdict[1, 0]
        between_ends = {Verdict.CONTACT} if (expected == Verdict.CONTACT).any() else set(expected.tolist())
        allowed = between_ends - {Verdict.CLEAR} or {Verdict.CLEAR}
        assert verdict in (allowed | {Verdict.UNRESOLVED} if allowed != {Verdict.CLEAR} else allowed), (arm, depth)
        answer[int(verdict)] = answer.get(int(verdict), 0) + 1
    assert {Verdict.CLEAR, Verdict.UNRESOLVED} <= set(answer), answer


def swing(origin, angles):
    """A motion of a block at rest and a body that turns about z at a place."""
    cosine, sine, zero = np.cos(angles), np.sin(angles), 0 * angles
    rotation = np.stack([cosine, -sine, zero, sine, cosine, zero, zero, zero, zero + 1], axis=1).reshape(-1, 3, 3)
    rotations = np.stack([np.tile(np.eye(3), (len(angles), 1, 1)), rotation], axis=1)
    return Motion(np.arange(len(angles)), np.tile([[0, 0, 0], origin], (len(angles), 1, 1)), rotations)


def single_walled_cup(open_at_top, segments=12):
    """A cylinder of radius and height 0.1, with a floor and, if it is not open, a lid."""
    angle = 2 * np.pi * np.arange(segments) / segments
    ring = 0.1 * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    up = np.array([[0, 0, 0.1]])
    points = np.concatenate([ring, ring + up, 0 * up, up])
    k, n = np.arange(segments), (np.arange(segments) + 1) % segments
    wall = np.concatenate([np.column_stack([k, n, n + segments]), np.column_stack([k, n + segments, k + segments])])
    floor = np.column_stack([n, k, np.full(segments, 2 * segments)])
    lid = np.column_stack([k + segments, n + segments, np.full(segments, 2 * segments + 1)])
    return TriangleMesh(points, np.concatenate([wall, floor] if open_at_top else [wall, floor, lid]))


@pytest.mark.parametrize("rotation", [np.eye(3), random_rotations(np.random.default_rng(1))], ids=["upright", "turned"])
def test_inside_of_a_single_walled_cup_is_undecided(rotation):
    """No surface of a cup without a lid says where its inside ends; above and beside its bounds a bead is clear."""
    inside, beside, unknown = Verdict.CONTAINED, Verdict.CLEAR, Verdict.UNRESOLVED
    # A bead of radius 4 mm in a cup of 0.1 m: where it is, in a cup with a lid, in one without.
    rows = [
        ([0, 0, 0.05], inside, unknown),  # the middle
        ([0, 0, 0.09], inside, unknown),
        ([0, 0, 0.1], Verdict.CONTACT, unknown),  # in the plane of the rim, where the lid is
        ([0, 0, 0.12], beside, beside),  # above
        ([0.12, 0, 0.05], beside, beside),
        ([0.09, 0.09, 0.05], beside, beside),  # within the box around the cup, 0.127 m from its axis
    ]
    positions = np.array([place for place, _, _ in rows])
    motion = Motion(
        np.arange(6), np.stack([0 * positions, positions @ rotation.T], axis=1), np.tile(rotation, (6, 2, 1, 1))
    )
    for open_at_top, column in ((False, 1), (True, 2)):
        bodies = [Body("cup", single_walled_cup(open_at_top)), Body("bead", ball_mesh(0.004))]
        verdicts = create_detector("exact", bodies).detect(motion).verdict[:, 0]
        assert verdicts.tolist() == [row[column] for row in rows]


def test_a_body_may_be_open_where_the_other_is_closed():
    """A cup without a lid lies in a closed block, which alone decides whether it is inside."""
    cup = single_walled_cup(open_at_top=True)
    inner = TriangleMesh(cup.vertices * 0.1, cup.faces)  # 1 cm: it fits into the block of 0.5 m
    assert verdicts_of("exact", box_mesh([0.5] * 3), np.zeros((1, 3))) == [Verdict.CONTAINED]
    bodies = [Body("block", box_mesh([0.5] * 3)), Body("cup", inner)]
    assert (
        create_detector("exact", bodies).detect(unrotated_motion(np.zeros((1, 2, 3)))).verdict[0, 0]
        == Verdict.CONTAINED
    )


def free_triangles(mesh, jitter):
    """Triangles that share no corner, as a file of too few digits leaves them."""
    corners = mesh.triangles + np.random.default_rng(0).uniform(-jitter, jitter, mesh.triangles.shape)
    return TriangleMesh(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))


def test_inside_unconnected_triangles_is_never_clear_and_outside_is():
    """Triangles share no corners, which lie up to 1e-7 m (fine faces) or 1e-9 m (large ones) apart."""
    positions = np.random.default_rng(6).uniform(-0.12, 0.12, (FRAMES, 3))
    overlaps, within = overlap_of_boxes(positions, [0 * SHIFT])
    for mesh in (free_triangles(grid_box(SIZE, count=4), jitter=1e-7), free_triangles(box_mesh(SIZE), jitter=1e-9)):
        verdict = verdicts_of("exact", mesh, positions)
        assert not (overlaps & (verdict == Verdict.CLEAR)).any()
        assert (verdict[~overlaps] == Verdict.CLEAR).all()
        assert within.sum() > 10
        assert np.array_equal(verdicts_of("exact", mesh, positions, live=True), verdict)


def test_sheet_in_the_plane_of_a_diagonal_is_inside():
    """A box of 1 m about (2, 2, 2) without a face below, and a sheet there, then above.

    Rays along X from the sheet, which is in the plane y = z, meet the diagonal of a side: whole numbers must decide.
    """
    box = shift_mesh(box_mesh([1.0] * 3), [2.0, 2.0, 2.0])
    below = np.flatnonzero((box.triangles[:, :, 2] == 1.5).all(axis=1))
    corners = np.array([[-1, -1, -1], [1, -1, -1], [1, 1, 1], [-1, 1, 1]]) / 8
    bodies = [Body("box", without_faces(box, below[0])), Body("sheet", TriangleMesh(corners, [[0, 1, 2], [0, 2, 3]]))]
    motion = unrotated_motion(np.array([[[0.0, 0, 0], [2.0, 2, 2]], [[0.0, 0, 0], [2.0, 2, 4]]]))
    verdicts = create_detector("exact", bodies).detect(motion).verdict[:, 0]
    assert verdicts.tolist() == [Verdict.CONTAINED, Verdict.CLEAR]


@pytest.mark.parametrize(
    ("so_far", "point_side", "at_hole", "side"),
    [
        (UNCERTAIN, INSIDE, False, INSIDE), (MAY_REACH, INSIDE, True, INSIDE),
        (UNCERTAIN, OUTSIDE, False, OUTSIDE), (MAY_REACH, OUTSIDE, True, MAY_REACH),
        (UNCERTAIN, UNDECIDED, False, UNDECIDED), (MAY_REACH, UNDECIDED, True, UNDECIDED),
        (UNCERTAIN, UNCERTAIN, False, UNCERTAIN), (MAY_REACH, UNCERTAIN, True, UNDECIDED),
    ],
)  # fmt: skip
def test_side_of_a_component_follows_each_of_its_points(so_far, point_side, at_hole, side):
    """One point inside tells; one outside tells away from holes, where rays through a hole may be lost."""
    assert side_of_component(so_far, point_side, at_hole) == side


def test_worse_of_two_states_does_not_depend_on_their_order():
    """The state nearer to INSIDE, of two components, is that of the body."""
    from_worst = [INSIDE, UNCERTAIN, UNDECIDED, MAY_REACH, OUTSIDE]
    for k, first in enumerate(from_worst):
        for second in from_worst[k:]:
            assert worse(first, second) == worse(second, first) == first


@pytest.mark.parametrize("k", [0, 1])
def test_points_close_to_a_lost_face_are_undecided(k):
    """Two boxes of 1 m about (0, 0, 0) and (3, 0, 0), of which each lacks a face towards +X."""
    box = box_mesh()
    lost = np.flatnonzero((box.triangles[:, :, 0] == 0.5).all(axis=1))[0]
    holed = without_faces(box, lost)
    surface = winding_surface(merge_meshes(holed, shift_mesh(holed, [3.0, 0, 0])))
    middle, step, shift = box.triangles[lost].mean(axis=0), np.array([0.001, 0, 0]), np.array([3.0 * k, 0, 0])
    points = [  # where it is, how often the box with its cap goes round it, and whether that is certain
        (middle - step, 1, False), (middle + step, 0, False),
        (np.array([-0.4, 0, 0]), 1, True), (np.array([-0.6, 0, 0]), 0, True),
    ]  # fmt: skip
    for point, windings, decided in points:
        assert decided_by_component(surface, k, point + shift, windings) == decided, point


@pytest.mark.parametrize("margin", [1e-12, 2e-3])
@pytest.mark.parametrize("gap", [1e-3, -1e-3])
def test_hulls_are_separated_by_a_gap_above_the_margin(gap, margin):
    """Two cubes of 1 m, one turned by 45 degrees so that an edge faces a side of the other, seen from 20 directions."""
    corners = box_mesh().vertices
    offset = np.array([0.5 + np.sqrt(0.5) + gap, 0.1, 0.2])
    for rotation in random_rotations(np.random.default_rng(2), 20):
        pose = rotation @ Rotation.from_euler("z", 45, degrees=True).as_matrix()
        separated = corners_separated.__wrapped__(corners, corners @ rotation.T, pose, rotation @ offset, margin)
        assert separated == (gap > margin)


def test_a_flat_sheet_contains_nothing():
    """A sheet of two triangles, and probes below it that do not touch; nothing about containment stays undecided."""
    sheet = TriangleMesh([[-1, -1, 0], [1, -1, 0.5], [1, 1, 0.5], [-1, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    positions = np.array([[0, 0, 0.4], [0.5, 0, 0.39], [0.5, 0, 0.35], [0.5, 0.5, 0.2]])
    assert (verdicts_of("exact", sheet, positions) == Verdict.CLEAR).all()
    bodies = [Body("sheet", sheet), Body("probe", box_mesh([PROBE_EDGE] * 3))]
    assert create_detector("exact", bodies).detect(unrotated_motion(np.zeros((1, 2, 3)))).containment == ("decided",)
