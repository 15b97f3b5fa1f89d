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


def shell(faces_kept, mesh):
    """A mesh without those of its faces that a rule on their middles leaves out."""
    mesh.update_faces(faces_kept(mesh.triangles_center))
    return mesh


def beaker_of_one_wall():
    """A cylinder without its lid: nobody can tell whether it is filled."""
    return shell(lambda middles: middles[:, 2] < 0.149, trimesh.creation.cylinder(0.08, 0.3, sections=20))


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


def loose_triangles(mesh):
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
    "ball-in-open-beaker": (beaker_of_one_wall(), trimesh.creation.icosphere(subdivisions=1, radius=0.02)),
    "ball-in-sound-rack": (rack(missing=0), trimesh.creation.icosphere(subdivisions=1, radius=0.03)),
    "ball-in-holed-rack": (rack(missing=1), trimesh.creation.icosphere(subdivisions=1, radius=0.03)),
    "loose-triangles": (
        loose_triangles(trimesh.creation.box((0.3, 0.3, 0.3))),
        loose_triangles(trimesh.creation.icosphere(subdivisions=1, radius=0.04)),
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


def winding_path(seed, reach):
    """Rotations (k, 3, 3) and positions (k, 3) along a smooth random path about the origin."""
    rng = np.random.default_rng(seed)
    knots = rng.uniform(-reach, reach, (12, 3))
    times, at = np.linspace(0, 11, FRAMES), np.arange(12)
    positions = np.stack([np.interp(times, at, knots[:, axis]) for axis in range(3)], axis=1)
    turns = np.cumsum(rng.normal(0.0, 0.02, (FRAMES, 3)), axis=0)
    return Rotation.from_rotvec(turns).as_matrix(), positions


def exact_contacts(first, second, rotations, positions):
    """Whether the exact detector finds contact, (FRAMES,)."""
    bodies = [Body(name, TriangleMesh(mesh.vertices, mesh.faces)) for name, mesh in (("a", first), ("b", second))]
    translations, turns = np.zeros((FRAMES, 2, 3)), np.tile(np.eye(3), (FRAMES, 2, 1, 1))
    translations[:, 1], turns[:, 1] = positions, rotations
    motion = Motion(np.arange(FRAMES) / 90, translations, turns)
    return counts_as_contact(create_detector("exact", bodies).detect(motion).verdict)[:, 0]


@pytest.mark.sampled(18)
@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
@pytest.mark.parametrize("shape", SHAPES)
def test_states_of_a_pair_agree_with_the_exact_detector(shape, seed):
    """Both bodies of SHAPES on a random path, 300 frames; at most one frame in 100 may be left unknown."""
    first, second = SHAPES[shape]
    rotations, positions = winding_path(seed, reach=0.3)
    states = PairStates(mesh_data(first), mesh_data(second)).states(rotations, positions, QueryBudget())
    contact = exact_contacts(first, second, rotations, positions)
    is_known = states != PairState.UNKNOWN
    assert is_known.mean() > 0.99
    assert ((states == PairState.CONTACT) == contact)[is_known].all()
    assert contact.any() and not contact.all()


def test_slow_motion_far_apart_needs_few_distance_queries():
    """Balls of 5 cm are 20 cm apart and move 2 cm at most; the budget allows ten distance queries for all frames."""
    ball = mesh_data(trimesh.creation.icosphere(subdivisions=1, radius=0.05))
    rotations, positions = np.tile(np.eye(3), (FRAMES, 1, 1)), np.zeros((FRAMES, 3))
    positions[:, 0] = 0.3 + 0.01 * np.sin(np.arange(FRAMES) / 50)
    pair = PairStates(ball, ball)
    cost_of_ten = 10 * (10.0 + 30.0 + 0.02 * 160)
    assert (pair.states(rotations, positions, QueryBudget(cost_of_ten)) == PairState.SEPARATED).all()


def test_query_dearer_than_the_budget_is_refused():
    """A collision and a distance of two balls of 80 faces take 10 + 30 + 0.02 * 160 microseconds by estimate."""
    ball = mesh_data(trimesh.creation.icosphere(subdivisions=1, radius=0.05))
    separated = np.eye(3)[None], np.array([[0.3, 0.0, 0.0]])
    assert PairStates(ball, ball).states(*separated, QueryBudget(43.3)) == [PairState.SEPARATED]
    with pytest.raises(QueryLimitError):
        PairStates(ball, ball).states(*separated, QueryBudget(43.1))


def test_bodies_that_rest_on_each_other_decide_nothing_by_rounding():
    """Gaps up to 9 um may be rounding, and are not called apart; 20 um are."""
    box = trimesh.creation.box((0.1, 0.1, 0.1))
    gaps = np.array([0.0, 1e-12, 1e-7, 9e-6, 2e-5])
    positions = np.zeros((5, 3))
    positions[:, 1] = 0.1 + gaps
    states = PairStates(mesh_data(box), mesh_data(box)).states(np.tile(np.eye(3), (5, 1, 1)), positions, QueryBudget())
    assert (states[:4] != PairState.SEPARATED).all() and states[4] == PairState.SEPARATED


def test_steps_into_touch_or_through_a_surface_are_noticed():
    """Cubes 50 mm apart, then 9 micrometres, which is no clear gap; a ball before a block, then inside it."""
    box, ball = trimesh.creation.box((0.1, 0.1, 0.1)), trimesh.creation.icosphere(subdivisions=1, radius=0.02)
    still = np.tile(np.eye(3), (2, 1, 1))
    approaching, entering = np.zeros((2, 2, 3))
    approaching[:, 1], entering[0, 1] = [0.15, 0.1 + 9e-6], 0.1
    states = PairStates(mesh_data(box), mesh_data(box)).states(still, approaching, QueryBudget())
    assert states.tolist() == [PairState.SEPARATED, PairState.UNKNOWN]
    states = PairStates(mesh_data(box), mesh_data(ball)).states(still, entering, QueryBudget())
    assert states.tolist() == [PairState.SEPARATED, PairState.CONTACT]


def test_inside_of_an_open_mesh_is_unknown():
    """A ball of 4 cm in the middle of a block of 30 cm, once with a face removed."""
    block, ball = trimesh.creation.box((0.3, 0.3, 0.3)), trimesh.creation.icosphere(subdivisions=1, radius=0.04)
    open_block = MeshData(block.vertices, block.faces[:-1])
    poses = np.eye(3)[None], np.zeros((1, 3))
    assert PairStates(open_block, mesh_data(ball)).states(*poses, QueryBudget()) == [PairState.UNKNOWN]
    assert PairStates(mesh_data(block), mesh_data(ball)).states(*poses, QueryBudget()) == [PairState.CONTACT]


MESHES_WITH_HOLES = {
    "one-face": lambda: shell(lambda middles: np.arange(len(middles)) > 0, trimesh.creation.box((0.3, 0.3, 0.3))),
    "ball-with-a-hole": lambda: shell(
        lambda middles: middles[:, 2] < 0.17, trimesh.creation.icosphere(subdivisions=2, radius=0.18)
    ),
    "half-a-ball": lambda: shell(
        lambda middles: middles[:, 2] < 0.0, trimesh.creation.icosphere(subdivisions=2, radius=0.18)
    ),
    "deep-tube": lambda: shell(lambda middles: middles[:, 2] < 0.249, trimesh.creation.cylinder(0.06, 0.5)),
}


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("shape", MESHES_WITH_HOLES)
def test_known_states_of_open_meshes_agree_with_exact(shape, seed):
    """A state may be unknown; one that is known must be right."""
    holed, ball = MESHES_WITH_HOLES[shape](), trimesh.creation.icosphere(subdivisions=1, radius=0.02)
    rotations, positions = winding_path(seed, reach=0.3)
    states = PairStates(mesh_data(holed), mesh_data(ball)).states(rotations, positions, QueryBudget())
    contact = exact_contacts(holed, ball, rotations, positions)
    is_known = states != PairState.UNKNOWN
    assert is_known.any()
    assert ((states == PairState.CONTACT) == contact)[is_known].all()


def test_body_that_crossed_no_surface_is_still_separated():
    """It sinks by a hole into a hollow ball, where alone nobody could tell whether the ball is filled."""
    hollow, small = MESHES_WITH_HOLES["ball-with-a-hole"](), trimesh.creation.icosphere(subdivisions=1, radius=0.02)
    positions, still = np.zeros((60, 3)), np.tile(np.eye(3), (60, 1, 1))
    positions[:, 2] = np.linspace(0.4, 0.0, 60)
    pair = PairStates(mesh_data(hollow), mesh_data(small))
    assert (pair.states(still, positions, QueryBudget()) == PairState.SEPARATED).all()
    assert pair.states(still[-1:], positions[-1:], QueryBudget()) == [PairState.UNKNOWN]


def test_inside_of_doubled_shells_is_never_taken_for_apart():
    """A ball in the middle of a box within a box, where parity of crossings says outside."""
    block, ball = trimesh.creation.box((0.3, 0.3, 0.3)), trimesh.creation.icosphere(subdivisions=1, radius=0.04)
    larger = trimesh.creation.box((0.4, 0.4, 0.4))
    nested = trimesh.util.concatenate([block, larger])
    poses = np.eye(3)[None], np.zeros((1, 3))
    assert PairStates(mesh_data(nested), mesh_data(ball)).states(*poses, QueryBudget()) == [PairState.UNKNOWN]


def test_degenerate_faces_do_not_change_states_of_a_pair():
    """A box of 0.1 m with a point and a segment as faces: overlap at 0.05 and 0.0999, apart at 0.1002."""
    box = trimesh.creation.box((0.1, 0.1, 0.1))
    point, segment = [0, 0, 0], [int(box.faces[0, 0]), int(box.faces[0, 1]), int(box.faces[0, 1])]
    with_flat = MeshData(box.vertices, np.concatenate([box.faces, [point, segment]]))
    assert can_be_tested(with_flat)
    positions = np.zeros((3, 3))
    positions[:, 0] = 0.05, 0.0999, 0.1002
    poses = np.tile(np.eye(3), (3, 1, 1)), positions
    expected = [PairState.CONTACT, PairState.CONTACT, PairState.SEPARATED]
    assert PairStates(with_flat, with_flat).states(*poses, QueryBudget()).tolist() == expected


def test_loose_segments_cost_no_query():
    """Three corners on a line are a face without area, one of whose corners no other face has: FCL would miss it."""
    assert not can_be_tested(MeshData([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 1, 3]]))
