"""States of a pair by FCL against those of the exact detector, on motions whose gaps close and open."""

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from cdcore import Body, Motion, TriangleMesh, create_detector
from cdcore.protocol import counts_as_contact
from replay.advice.pair_states import PairState, PairStates, QueryBudget, QueryLimitError, can_be_tested
from sessions import MeshData

FRAMES = 300


def cup():
    """A square cup with walls, so that a body can hang in its hollow without being inside its solid."""
    outer, inner = trimesh.creation.box((0.2, 0.2, 0.2)), trimesh.creation.box((0.16, 0.2, 0.16))
    inner.apply_translation((0.0, 0.02, 0.0))
    return trimesh.boolean.difference([outer, inner], engine="manifold")


def with_faces(is_kept, mesh):
    """The mesh with those of its faces whose middles a rule keeps."""
    mesh.update_faces(is_kept(mesh.triangles_center))
    return mesh


def beaker_without_lid():
    """A cylinder without its lid: nobody can tell whether it is filled."""
    return with_faces(lambda middles: middles[:, 2] < 0.149, trimesh.creation.cylinder(0.08, 0.3, sections=20))


def rack(*, missing):
    """Five boxes about a hollow; the first has lost a face where asked."""
    walls = [
        ((0.3, 0.3, 0.02), (0.0, 0.0, -0.15)),
        ((0.3, 0.02, 0.3), (0.0, 0.15, 0.0)),
        ((0.3, 0.02, 0.3), (0.0, -0.15, 0.0)),
        ((0.02, 0.3, 0.3), (0.15, 0.0, 0.0)),
        ((0.02, 0.3, 0.3), (-0.15, 0.0, 0.0)),
    ]
    boxes = [trimesh.creation.box(size).apply_translation(middle) for size, middle in walls]
    whole = trimesh.util.concatenate(boxes)
    whole.update_faces(np.arange(len(whole.faces)) >= missing)
    return whole


def separate_triangles(mesh):
    """The same mesh with three vertices of its own for each face, as STL files have them."""
    return trimesh.Trimesh(mesh.triangles.reshape(-1, 3), np.arange(3 * len(mesh.faces)).reshape(-1, 3), process=False)


def two_balls():
    """A body of two parts, of which one may be inside another body while the other is not."""
    return trimesh.util.concatenate(
        [
            trimesh.creation.icosphere(subdivisions=1, radius=0.03),
            trimesh.creation.icosphere(subdivisions=1, radius=0.03).apply_translation((0.22, 0.0, 0.0)),
        ]
    )


SHAPES = {
    "ball-in-open-beaker": (beaker_without_lid(), trimesh.creation.icosphere(subdivisions=1, radius=0.02)),
    "ball-in-sound-rack": (rack(missing=0), trimesh.creation.icosphere(subdivisions=1, radius=0.03)),
    "ball-in-holed-rack": (rack(missing=1), trimesh.creation.icosphere(subdivisions=1, radius=0.03)),
    "loose-triangles": (
        separate_triangles(trimesh.creation.box((0.3, 0.3, 0.3))),
        separate_triangles(trimesh.creation.icosphere(subdivisions=1, radius=0.04)),
    ),
    "two-balls": (trimesh.creation.box((0.2, 0.2, 0.2)), two_balls()),
    "balls": (
        trimesh.creation.icosphere(subdivisions=2, radius=0.1),
        trimesh.creation.icosphere(subdivisions=1, radius=0.05),
    ),
    "rod-in-cup": (cup(), trimesh.creation.box((0.03, 0.1, 0.02))),
    "ball-in-block": (trimesh.creation.box((0.3, 0.3, 0.3)), trimesh.creation.icosphere(subdivisions=1, radius=0.04)),
    "block-about-ball": (
        trimesh.creation.icosphere(subdivisions=1, radius=0.04),
        trimesh.creation.box((0.3, 0.3, 0.3)),
    ),
}


def mesh_data(mesh):
    """The mesh as a session has it."""
    return MeshData(mesh.vertices, mesh.faces)


def ball(radius, subdivisions=1):
    """A ball of 80 faces, or four times as many for each further subdivision, about the origin."""
    return trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius)


def states_of(first, second, rotations, positions, budget=None):
    """States of a pair of meshes in each frame; the first is at the origin, the second has these poses."""
    pair = PairStates(mesh_data(first), mesh_data(second))
    return pair.states(rotations, np.asarray(positions), budget or QueryBudget()).tolist()


def unrotated(count):
    """Rotations (count, 3, 3) of a body that does not turn."""
    return np.tile(np.eye(3), (count, 1, 1))


def winding_path(seed, reach):
    """Rotations (k, 3, 3) and positions (k, 3) along a smooth random path about the origin."""
    rng = np.random.default_rng(seed)
    knots = rng.uniform(-reach, reach, (12, 3))
    times, at = np.linspace(0, 11, FRAMES), np.arange(12)
    positions = np.stack([np.interp(times, at, knots[:, axis]) for axis in range(3)], axis=1)
    rotation_vectors = np.cumsum(rng.normal(0.0, 0.02, (FRAMES, 3)), axis=0)
    return Rotation.from_rotvec(rotation_vectors).as_matrix(), positions


def exact_contacts(first, second, rotations, positions):
    """Whether the exact detector finds contact, (FRAMES,)."""
    bodies = [Body(name, TriangleMesh(mesh.vertices, mesh.faces)) for name, mesh in (("a", first), ("b", second))]
    translations, matrices = np.zeros((FRAMES, 2, 3)), np.tile(np.eye(3), (FRAMES, 2, 1, 1))
    translations[:, 1], matrices[:, 1] = positions, rotations
    motion = Motion(np.arange(FRAMES) / 90, translations, matrices)
    return counts_as_contact(create_detector("exact", bodies).detect(motion).verdict)[:, 0]


@pytest.mark.sampled(18)
@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
@pytest.mark.parametrize("shape", SHAPES)
def test_states_of_a_pair_agree_with_the_exact_detector(shape, seed):
    """The first of two bodies rests, the second moves along a random path about it, in 300 frames.

    States by FCL are the verdicts of the exact detector, which has contact in some frames and none in others. A state
    would be unknown where surfaces come within 0.01 mm without meeting, or a hole leaves open what is inside: nowhere
    on these paths.
    """
    first, second = SHAPES[shape]
    rotations, positions = winding_path(seed, reach=0.3)
    states = np.array(states_of(first, second, rotations, positions))
    contact = exact_contacts(first, second, rotations, positions)
    assert 0 < contact.sum() < FRAMES
    assert PairState.UNKNOWN not in states
    assert ((states == PairState.CONTACT) == contact).all()


COST_OF_A_PAIR = 10.0 + 30.0 + 0.02 * 160
"""Microseconds, by estimate, of a collision query and a distance query of two balls of 80 faces each."""


def test_slow_motion_at_a_distance_needs_few_distance_queries():
    """Two balls of 5 cm radius, 0.3 m from middle to middle, sway by 1 cm in 300 frames: always 19 cm apart or more.

    The budget allows queries for ten frames: a distance tells for how many frames nothing can touch.
    """
    positions = np.zeros((FRAMES, 3))
    positions[:, 0] = 0.3 + 0.01 * np.sin(np.arange(FRAMES) / 50)
    states = states_of(ball(0.05), ball(0.05), unrotated(FRAMES), positions, QueryBudget(10 * COST_OF_A_PAIR))
    assert states == [PairState.SEPARATED] * FRAMES


def test_query_within_the_budget_is_answered():
    """Two balls of 5 cm radius, 0.3 m apart, in one frame; the budget is a little more than 43.2 us, by estimate."""
    states = states_of(ball(0.05), ball(0.05), unrotated(1), [[0.3, 0.0, 0.0]], QueryBudget(COST_OF_A_PAIR + 0.1))
    assert states == [PairState.SEPARATED]


def test_query_dearer_than_the_budget_is_refused():
    """Two balls of 5 cm radius, 0.3 m apart, in one frame; the budget is a little less than 43.2 us, by estimate."""
    with pytest.raises(QueryLimitError):
        states_of(ball(0.05), ball(0.05), unrotated(1), [[0.3, 0.0, 0.0]], QueryBudget(COST_OF_A_PAIR - 0.1))


def test_bodies_that_rest_on_each_other_decide_nothing_by_rounding():
    """Cubes of 0.1 m, one above the other: gaps up to 9 um may be rounding, and are not called separated; 20 um are."""
    cube = trimesh.creation.box((0.1, 0.1, 0.1))
    gaps = [0.0, 1e-12, 1e-7, 9e-6, 2e-5]
    positions = [[0.0, 0.1 + gap, 0.0] for gap in gaps]
    *states_by_rounding, state_at_20_um = states_of(cube, cube, unrotated(len(gaps)), positions)
    assert PairState.SEPARATED not in states_by_rounding
    assert state_at_20_um == PairState.SEPARATED


def test_step_into_touch_is_not_called_separated():
    """Cubes of 0.1 m, 50 mm apart in the first frame, 9 um in the second, which may be rounding."""
    cube = trimesh.creation.box((0.1, 0.1, 0.1))
    states = states_of(cube, cube, unrotated(2), [[0.0, 0.15, 0.0], [0.0, 0.1 + 9e-6, 0.0]])
    assert states == [PairState.SEPARATED, PairState.UNKNOWN]


def test_step_through_a_surface_is_contact():
    """A ball of 2 cm radius, 10 cm from the middle of a cube of 0.1 m in the first frame, in its middle in the second.

    There it touches no face of the cube, but it is inside.
    """
    cube = trimesh.creation.box((0.1, 0.1, 0.1))
    states = states_of(cube, ball(0.02), unrotated(2), [[0.0, 0.1, 0.0], [0.0, 0.0, 0.0]])
    assert states == [PairState.SEPARATED, PairState.CONTACT]


def test_inside_of_a_closed_mesh_is_contact():
    """A ball of 4 cm radius in the middle of a cube of 0.3 m, which it does not touch."""
    cube = trimesh.creation.box((0.3, 0.3, 0.3))
    assert states_of(cube, ball(0.04), unrotated(1), [[0.0, 0.0, 0.0]]) == [PairState.CONTACT]


def test_inside_of_an_open_mesh_is_unknown():
    """A ball of 4 cm radius in the middle of a cube of 0.3 m that lacks a face: is the cube filled or hollow?"""
    cube = trimesh.creation.box((0.3, 0.3, 0.3))
    cube.update_faces(np.arange(len(cube.faces)) > 0)
    assert states_of(cube, ball(0.04), unrotated(1), [[0.0, 0.0, 0.0]]) == [PairState.UNKNOWN]


def ball_with_a_hole():
    """The surface of a ball of 18 cm radius, open around its upper pole."""
    return with_faces(lambda middles: middles[:, 2] < 0.17, ball(0.18, subdivisions=2))


MESHES_WITH_HOLES = {
    "cube that lacks a face": lambda: with_faces(
        lambda middles: np.arange(len(middles)) > 0, trimesh.creation.box((0.3, 0.3, 0.3))
    ),
    "ball with a hole": ball_with_a_hole,
    "half a ball": lambda: with_faces(lambda middles: middles[:, 2] < 0.0, ball(0.18, subdivisions=2)),
    "deep tube": lambda: with_faces(lambda middles: middles[:, 2] < 0.249, trimesh.creation.cylinder(0.06, 0.5)),
}


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("shape", MESHES_WITH_HOLES)
def test_known_states_of_open_meshes_agree_with_exact(shape, seed):
    """A ball of 2 cm radius moves along a random path about a mesh with a hole, in 300 frames.

    Many states may be unknown there; those that are known are the verdicts of the exact detector.
    """
    mesh_with_hole = MESHES_WITH_HOLES[shape]()
    rotations, positions = winding_path(seed, reach=0.3)
    states = np.array(states_of(mesh_with_hole, ball(0.02), rotations, positions))
    contact = exact_contacts(mesh_with_hole, ball(0.02), rotations, positions)
    is_known = states != PairState.UNKNOWN
    assert is_known.any()
    assert ((states == PairState.CONTACT) == contact)[is_known].all()


def test_body_that_crossed_no_surface_is_still_separated():
    """A ball of 2 cm radius sinks in 60 frames through the upper hole of a hollow ball into its middle, by 40 cm.

    It is separated all the time, since it crossed no surface; the last frame alone does not tell whether the hollow
    ball is filled.
    """
    positions = np.zeros((60, 3))
    positions[:, 2] = np.linspace(0.4, 0.0, 60)
    assert states_of(ball_with_a_hole(), ball(0.02), unrotated(60), positions) == [PairState.SEPARATED] * 60
    assert states_of(ball_with_a_hole(), ball(0.02), unrotated(1), positions[-1:]) == [PairState.UNKNOWN]


def test_inside_of_doubled_shells_is_never_taken_for_separated():
    """A ball of 4 cm radius in the middle of a cube of 0.3 m within a cube of 0.4 m, all one mesh.

    A ray from there crosses two surfaces, an even number, which by parity would be outside.
    """
    boxes = [trimesh.creation.box((edge, edge, edge)) for edge in (0.3, 0.4)]
    nested = trimesh.util.concatenate(boxes)
    assert states_of(nested, ball(0.04), unrotated(1), [[0.0, 0.0, 0.0]]) == [PairState.UNKNOWN]


def test_degenerate_faces_do_not_change_states_of_a_pair():
    """A cube of 0.1 m, two of whose faces are a point and a segment, beside itself: it overlaps 0.05 and 0.0999 m away.

    At 0.1002 m it is separated.
    """
    cube = trimesh.creation.box((0.1, 0.1, 0.1))
    first, second, _third = cube.faces[0].tolist()
    point, segment = [0, 0, 0], [first, second, second]
    with_flat_faces = MeshData(cube.vertices, np.concatenate([cube.faces, [point, segment]]))
    assert can_be_tested(with_flat_faces)
    positions = [[0.05, 0.0, 0.0], [0.0999, 0.0, 0.0], [0.1002, 0.0, 0.0]]
    assert states_of(with_flat_faces, with_flat_faces, unrotated(3), positions) == [
        PairState.CONTACT,
        PairState.CONTACT,
        PairState.SEPARATED,
    ]


def test_mesh_with_a_dangling_segment_is_not_tested():
    """Corners 0, 1 and 2 lie on a line: a face without area, whose corner 2 no other face has; FCL would miss it."""
    corners = [[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0]]
    assert not can_be_tested(MeshData(corners, [[0, 1, 2], [0, 1, 3]]))
