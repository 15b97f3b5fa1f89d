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
"""Metres of the second block's middle from the first's, which is the origin."""
PROBE_EDGE = 0.01
"""Metres of a small cube that is asked about."""
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
    """A block of 0.2 x 0.12 x 0.12 m that lacks its side at x = -0.1 m, through which bodies pass without touching."""
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
    """Cubes of 1 cm at 150 random places in and around a block of 20 x 12 x 12 cm or two, whose mesh may lack faces,
    draw some twice, etc.

    Clear is none that overlaps a block, and every one beside the bounds of the mesh; any other is clear or undecided.
    Where faces are missing at most a tenth is undecided, else nothing. Frame by frame (live) the verdicts are the same.
    """
    mesh, middles, lost_faces = damaged()[name]
    mesh = reversed_faces(mesh) if wound == "inwards" else mesh
    positions = np.random.default_rng(3).uniform(-0.16, 0.26, (FRAMES, 3)) * [1.0, 0.6, 0.6]
    verdict = verdicts_of("exact", mesh, positions)
    overlaps, within = overlap_of_boxes(positions, middles)
    clear, undecided = verdict == Verdict.CLEAR, verdict == Verdict.UNRESOLVED
    assert within.sum() > 10, "many probes are inside"
    assert not (overlaps & clear).any()
    assert (overlaps | clear | undecided).all()
    lower, upper = mesh.bounds
    beside = ((positions - PROBE_EDGE / 2 > upper) | (positions + PROBE_EDGE / 2 < lower)).any(axis=1)
    assert beside.any()
    assert clear[beside].all()
    assert undecided.mean() <= (0.1 if lost_faces else 0.0)
    assert np.array_equal(verdicts_of("exact", mesh, positions, live=True), verdict)


@pytest.mark.sampled(2)
@pytest.mark.parametrize("detector", DETECTORS)
@pytest.mark.parametrize("live", [False, True], ids=["offline", "live"])
def test_every_detector_that_claims_containment_agrees(detector, live):
    """A block lacks its side at x = -0.1 m; cubes of 1 cm at 40 places within 3 cm of the middle of that side.

    Some are clear, before the hole, and some are undecided, in it; every detector says of each what ``exact`` says.
    """
    mesh = without_a_side()
    positions = np.array([-0.1, 0.0, 0.0]) + np.random.default_rng(4).uniform(-0.03, 0.03, (40, 3))
    expected = verdicts_of("exact", mesh, positions)
    assert set(expected.tolist()) >= {Verdict.UNRESOLVED, Verdict.CLEAR}
    assert np.array_equal(verdicts_of(detector, mesh, positions, live=live, **DETECTORS[detector]), expected)


@pytest.mark.slow
@pytest.mark.parametrize("live", [False, True], ids=["offline", "live"])
def test_slow_motion_through_a_hole_is_followed_frame_by_frame(live):
    """A cube of 1 cm moves from x = -0.13 m to the middle of a block that lacks its side at -0.1 m, 0.9 mm a frame.

    It is clear at first and never once its middle is inside; every detector says what ``exact`` says in every frame.
    """
    mesh, x = without_a_side(), np.linspace(-0.13, 0.0, 150)
    positions = x[:, None] * [1.0, 0.0, 0.0]
    expected = verdicts_of("exact", mesh, positions)
    assert expected[0] == Verdict.CLEAR
    assert (expected[x > -0.1] != Verdict.CLEAR).all()
    for detector, settings in DETECTORS.items():
        assert np.array_equal(verdicts_of(detector, mesh, positions, live=live, **settings), expected), detector


def bodies_and_motion_at_x(positions):
    """Bodies, a block without its side at x = -0.1 m and a cube of 1 cm, and a motion with the cube at these x."""
    bodies = [Body("block", without_a_side()), Body("probe", box_mesh([PROBE_EDGE] * 3))]
    points = np.array(positions)[:, None] * [1.0, 0.0, 0.0]
    return bodies, unrotated_motion(np.stack([0 * points, points], axis=1))


def test_an_interval_through_a_hole_is_not_clear():
    """A cube is outside in frames 0, 3 and 4, at x = -0.2 m, and inside, past the hole at -0.1 m, in frames 1 and 2.

    ``continuous`` answers for the path since the frame before: those of frames 1 to 3 begin or end inside.
    """
    bodies, motion = bodies_and_motion_at_x([-0.2, 0.0, 0.0, -0.2, -0.2])
    answer = create_detector("continuous", bodies).detect(motion)
    verdict = answer.verdict[:, 0]
    assert verdict[0] == verdict[4] == Verdict.CLEAR
    assert (verdict[1:4] != Verdict.CLEAR).all()
    unresolved_frames = np.flatnonzero(verdict == Verdict.UNRESOLVED).tolist()
    reasons = {answer.reasons[frame, 0] for frame in unresolved_frames}
    assert reasons == {"inside undecided: block has holes"}


def test_intervals_through_a_hole_are_the_same_in_blocks():
    """A cube goes through the hole of a block, from x = -0.2 m to 0 in frame 1 and back in frame 3: five frames as one
    motion, and in blocks of three frames and two.
    """
    bodies, motion = bodies_and_motion_at_x([-0.2, 0.0, 0.0, -0.2, -0.2])
    whole = create_detector("continuous", bodies).detect(motion)
    blocks = list(create_detector("continuous", bodies).stream([motion.frames(0, 3), motion.frames(3, 5)]))
    assert np.array_equal(np.concatenate([block.verdict for block in blocks]), whole.verdict)


LOST_FACES = {"one side": range(32), "one square": (10, 11), "four squares": (10, 11, 12, 13, 18, 19, 20, 21)}


@pytest.mark.sampled(3)
@pytest.mark.parametrize("lost", LOST_FACES)
def test_arc_through_a_hole_and_back_is_not_clear(lost):
    """A bead of 4 mm on an arm of 2 to 5 cm swings by 160 degrees between two frames, at both of which it is outside.

    At 61 angles of the arc ``exact`` says whether it touched the block, or dipped into it through the hole, between the
    two. ``continuous`` sees the two frames: a contact must be a contact, or undecided; a dip must not be clear; what is
    clear all the way must be.
    """
    rng = np.random.default_rng(7)  # arcs outside and through each of the holes
    block = Body("block", without_faces(grid_box(SIZE, count=4), *LOST_FACES[lost]))
    answers = set()
    for _ in range(10):
        arm, shift = rng.uniform(0.02, 0.05), rng.uniform(-0.035, 0.005)
        depth = rng.uniform(-0.005, 0.8 * arm - 0.005)
        bead = Body("bead", shift_mesh(box_mesh([0.004] * 3), [arm, 0.0, 0.0]))
        hub = np.array([-SIZE[0] / 2 + depth - arm, -0.015, shift])
        ends, dense = (swing(hub, np.linspace(-1.4, 1.4, count)) for count in (2, 61))
        on_the_arc = create_detector("exact", [block, bead]).detect(dense).verdict[:, 0].tolist()
        assert on_the_arc[0] == on_the_arc[-1] == Verdict.CLEAR
        verdict = create_detector("continuous", [block, bead]).detect(ends).verdict[1, 0]
        if Verdict.CONTACT in on_the_arc:
            allowed = {Verdict.CONTACT, Verdict.UNRESOLVED}
        elif set(on_the_arc) != {Verdict.CLEAR}:
            allowed = {Verdict.UNRESOLVED} | set(on_the_arc) - {Verdict.CLEAR}
        else:
            allowed = {Verdict.CLEAR}
        assert verdict in allowed, (arm, depth)
        answers.add(int(verdict))
    assert answers >= {Verdict.CLEAR, Verdict.UNRESOLVED}, "arcs outside and through the hole"


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
    """A bead of radius 4 mm in and around a cup, a cylinder of radius and height 0.1 m, with a lid and without.

    No surface of a cup without a lid says where its inside ends; above and beside it a bead is clear.
    """
    inside, contact, clear, unknown = Verdict.CONTAINED, Verdict.CONTACT, Verdict.CLEAR, Verdict.UNRESOLVED
    rows = [  # where the bead is; the verdict with a lid, and without
        ([0, 0, 0.05], inside, unknown),  # the middle
        ([0, 0, 0.09], inside, unknown),  # 1 cm below the rim
        ([0, 0, 0.1], contact, unknown),  # in the plane of the rim, where the lid is
        ([0, 0, 0.12], clear, clear),  # above
        ([0.12, 0, 0.05], clear, clear),  # beside
        ([0.09, 0.09, 0.05], clear, clear),  # within the box around the cup, 0.127 m from its axis
    ]
    bead_positions, with_lid, without_lid = zip(*rows, strict=True)
    positions = np.array(bead_positions) @ rotation.T
    motion = Motion(np.arange(6), np.stack([0 * positions, positions], axis=1), np.tile(rotation, (6, 2, 1, 1)))
    for open_at_top, expected in ((False, with_lid), (True, without_lid)):
        bodies = [Body("cup", single_walled_cup(open_at_top)), Body("bead", ball_mesh(0.004))]
        verdicts = create_detector("exact", bodies).detect(motion).verdict[:, 0]
        assert verdicts.tolist() == list(expected)


def test_a_body_may_be_open_where_the_other_is_closed():
    """A cup of 1 cm without a lid in the middle of a closed block of 0.5 m, which alone decides what is inside."""
    cup = single_walled_cup(open_at_top=True)
    small_cup = TriangleMesh(cup.vertices * 0.1, cup.faces)
    bodies = [Body("block", box_mesh([0.5] * 3)), Body("cup", small_cup)]
    answer = create_detector("exact", bodies).detect(unrotated_motion(np.zeros((1, 2, 3))))
    assert answer.verdict.tolist() == [[Verdict.CONTAINED]]


def free_triangles(mesh, jitter):
    """Triangles that share no corner, as a file of too few digits leaves them."""
    corners = mesh.triangles + np.random.default_rng(0).uniform(-jitter, jitter, mesh.triangles.shape)
    return TriangleMesh(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))


@pytest.mark.parametrize(
    ("count", "jitter"),
    [pytest.param(4, 1e-7, id="4 x 4 squares a side, 1e-7 m"), pytest.param(1, 1e-9, id="a square a side, 1e-9 m")],
)
def test_inside_unconnected_triangles_is_never_clear_and_outside_is(count, jitter):
    """A block of triangles that share no corners: those that should be equal lie up to twice the jitter apart.

    Cubes of 1 cm at 150 random places are clear exactly where they do not overlap the block, live too.
    """
    mesh = free_triangles(grid_box(SIZE, count), jitter)
    positions = np.random.default_rng(6).uniform(-0.12, 0.12, (FRAMES, 3))
    overlaps, within = overlap_of_boxes(positions, middles=[np.zeros(3)])
    assert within.sum() > 10, "many probes are inside"
    verdict = verdicts_of("exact", mesh, positions)
    assert np.array_equal(verdict == Verdict.CLEAR, ~overlaps)
    assert np.array_equal(verdicts_of("exact", mesh, positions, live=True), verdict)


def test_sheet_in_the_plane_of_a_diagonal_is_inside():
    """A box of 1 m about (2, 2, 2) lacks a triangle below; a sheet of 0.25 m is in its middle, then 2 m higher.

    Rays along x from the sheet, which is in the plane y = z, meet the diagonal of a side: whole numbers must decide.
    """
    box = shift_mesh(box_mesh([1.0] * 3), [2.0, 2.0, 2.0])
    faces_below = np.flatnonzero((box.triangles[:, :, 2] == 1.5).all(axis=1))
    sheet = TriangleMesh(np.array([[-1, -1, -1], [1, -1, -1], [1, 1, 1], [-1, 1, 1]]) / 8, [[0, 1, 2], [0, 2, 3]])
    bodies = [Body("box", without_faces(box, faces_below[0])), Body("sheet", sheet)]
    motion = unrotated_motion(np.array([[[0.0, 0, 0], [2.0, 2, 2]], [[0.0, 0, 0], [2.0, 2, 4]]]))
    verdicts = create_detector("exact", bodies).detect(motion).verdict[:, 0]
    assert verdicts.tolist() == [Verdict.CONTAINED, Verdict.CLEAR]


@pytest.mark.parametrize(
    ("point_side", "away_from_holes", "at_hole"),
    [
        pytest.param(INSIDE, INSIDE, INSIDE, id="a point inside settles it"),
        pytest.param(OUTSIDE, OUTSIDE, MAY_REACH, id="a point outside does, away from holes"),
        pytest.param(UNDECIDED, UNDECIDED, UNDECIDED, id="undecided stays so"),
        pytest.param(UNCERTAIN, UNCERTAIN, UNDECIDED, id="an uncertain ray asks for another point, away from holes"),
    ],
)
def test_side_of_a_component_follows_each_of_its_points(point_side, away_from_holes, at_hole):
    """A component is on the side of a point of it; until then it is UNCERTAIN, or at a hole it MAY_REACH through it.

    There a point outside does not say that all of it is.
    """
    is_at_hole = False
    assert side_of_component(UNCERTAIN, point_side, is_at_hole) == away_from_holes
    is_at_hole = True
    assert side_of_component(MAY_REACH, point_side, is_at_hole) == at_hole


def test_worse_of_two_states_does_not_depend_on_their_order():
    """A body has the state of that of its components that is nearer to INSIDE; the list is in that order."""
    from_worst = [INSIDE, UNCERTAIN, UNDECIDED, MAY_REACH, OUTSIDE]
    for k, first in enumerate(from_worst):
        for second in from_worst[k:]:
            assert worse(first, second) == worse(second, first) == first


@pytest.mark.parametrize("component", [0, 1], ids=["box about x = 0 m", "box about x = 3 m"])
def test_points_close_to_a_lost_face_are_undecided(component):
    """Two boxes of 1 m that lack a triangle of their side at +0.5 m; ``windings``: how often the box with a cap in its
    hole goes round a point, 1 inside and 0 outside. 1 mm from the cap that may be wrong; 0.9 m from it, it is not.
    """
    box = box_mesh()
    lost_face = np.flatnonzero((box.triangles[:, :, 0] == 0.5).all(axis=1))[0]
    holed = without_faces(box, lost_face)
    surface = winding_surface(merge_meshes(holed, shift_mesh(holed, [3.0, 0, 0])))
    middle_of_hole, step = box.triangles[lost_face].mean(axis=0), np.array([0.001, 0, 0])
    centre = np.array([3.0 * component, 0, 0])
    rows = [  # point in the box, windings, whether they are certain
        (middle_of_hole - step, 1, False),
        (middle_of_hole + step, 0, False),
        (np.array([-0.4, 0, 0]), 1, True),
        (np.array([-0.6, 0, 0]), 0, True),
    ]
    for point, windings, certain in rows:
        assert decided_by_component(surface, component, centre + point, windings) == certain, point


@pytest.mark.parametrize(
    ("gap", "margin", "separated"),
    [
        pytest.param(1e-3, 1e-12, True, id="1 mm apart"),
        pytest.param(1e-3, 2e-3, False, id="1 mm apart, margin 2 mm"),
        pytest.param(-1e-3, 1e-12, False, id="1 mm deep"),
        pytest.param(-1e-3, 2e-3, False, id="1 mm deep, margin 2 mm"),
    ],
)
def test_hulls_are_separated_by_a_gap_above_the_margin(gap, margin, separated):
    """Two cubes of 1 m, of which one is turned by 45 degrees, so that an edge of it, root of 1/2 m from its middle,
    faces a side of the other, 0.5 m from its own; both in 20 rotations. The kernel runs as Python (``__wrapped__``).
    """
    corners = box_mesh().vertices
    offset = np.array([0.5 + np.sqrt(0.5) + gap, 0.1, 0.2])
    for rotation in random_rotations(np.random.default_rng(2), 20):
        pose = rotation @ Rotation.from_euler("z", 45, degrees=True).as_matrix()
        answer = corners_separated.__wrapped__(corners, corners @ rotation.T, pose, rotation @ offset, margin)
        assert answer == separated


SHEET = TriangleMesh([[-1, -1, 0], [1, -1, 0.5], [1, 1, 0.5], [-1, 1, 0]], [[0, 1, 2], [0, 2, 3]])


def test_a_flat_sheet_contains_nothing():
    """A sheet of 2 x 2 m in the plane z = (x + 1) / 4 m, two cubes of 1 cm above it and two below: all are clear."""
    positions = np.array([[0, 0, 0.4], [0.5, 0, 0.39], [0.5, 0, 0.35], [0.5, 0.5, 0.2]])
    assert (verdicts_of("exact", SHEET, positions) == Verdict.CLEAR).all()


def test_containment_beside_a_flat_sheet_is_decided():
    """A sheet of two triangles has no inside, so that nothing about a cube's containment stays undecided."""
    bodies = [Body("sheet", SHEET), Body("probe", box_mesh([PROBE_EDGE] * 3))]
    assert create_detector("exact", bodies).detect(unrotated_motion(np.zeros((1, 2, 3)))).containment == ("decided",)
