"""Hard cases 27, 28, 38, 39, 41 to 43: contained, resting, kissing, far and scaled bodies are as they should be."""

import numpy as np
import pytest
from support.shapes import (
    ball_mesh,
    beaker_mesh,
    box_mesh,
    icosphere_mesh,
    lab,
    merged,
    moved,
    random_rotations,
    rod_mesh,
)

from cdcore import Body, Motion, TriangleMesh, Verdict, create_detector, intersecting_faces, join
from cdcore.narrow.brute_force import meeting_faces_exhaustive
from cdcore.numerics import place_points
from replay.comparison.compare import compare
from replay.comparison.outcome import Outcome
from replay.comparison.tolerance import Tolerance
from replay.prepare.assembly import Assembly

LIFTS = (1e-12, 1e-9, 1e-7, 5e-7, 1e-6, 2e-6, 1e-5)


def posed(body, motion, frame, number):
    triangles = body.mesh.triangles
    placed = place_points(triangles.reshape(-1, 3), motion.rotations[frame, number], motion.translations[frame, number])
    return placed.reshape(-1, 3, 3)


def exhaustive(bodies, motion, frame):
    return meeting_faces_exhaustive(*(posed(bodies[k], motion, frame, k) for k in range(2)))


def in_worlds(bodies, count, seed, world=1.0):
    """Both bodies in the same ``count`` random poses; the first as it stands."""
    rng = np.random.default_rng(seed)
    turn, place = random_rotations(rng, count), rng.normal(size=(count, 3)) * world
    turn[0], place[0] = np.eye(3), 0.0
    return Motion(np.arange(count) / 90, np.repeat(place[:, None], 2, 1), np.repeat(turn[:, None], 2, 1))


def equals_exhaustive(bodies, motion):
    detection = create_detector("exact", bodies, containment=False).detect(motion, faces=True)
    counts = []
    for frame in range(len(motion)):
        want = exhaustive(bodies, motion, frame)
        assert np.array_equal(detection.faces(frame, 0), want)
        assert (detection.verdict[frame, 0] == Verdict.CONTACT) == (len(want) > 0)
        counts.append(len(want))
    return counts


def glass_on_table(lift=0.0):
    table = box_mesh((0.3, 0.3, 0.02), (0, 0, -0.01))
    vertices = beaker_mesh().vertices.copy()
    vertices[:, 2] += lift
    return [Body("glass", TriangleMesh(vertices, beaker_mesh().faces)), Body("table", table)]


@pytest.mark.parametrize("shift", [1e3, 1e5, 1e7])
@pytest.mark.parametrize("baked", [False, True], ids=["in the pose", "in the vertices"])
def test_38_far_from_the_origin_the_answer_is_that_of_the_points_there(shift, baked):
    offset = np.array([shift, -shift / 3, shift / 7])
    bodies = [Body("ball", ball_mesh(0.5)), Body("box", box_mesh())]
    places = np.array([[[x, 0.1, 0.2], [0, 0, 0]] for x in (0.9, 0.99, 1.0, 1 + 1e-9, 1.01)])
    if baked:
        bodies = [Body(body.name, moved(body.mesh, offset)) for body in bodies]
    else:
        places = places + offset
    counts = equals_exhaustive(bodies, Motion(np.arange(5), places, np.tile(np.eye(3), (5, 2, 1, 1))))
    assert counts[0] > 0 and counts[-1] == 0


@pytest.mark.parametrize("power", [-20, -10, 10, 20])
def test_39_scenes_scaled_by_a_power_of_two_have_the_same_answers_and_faces(power):
    bodies, motion = lab(60, seed=2)
    scale = 2.0**power
    scaled = [Body(body.name, TriangleMesh(body.mesh.vertices * scale, body.mesh.faces)) for body in bodies]
    bigger = Motion(motion.times, motion.translations * scale, motion.rotations, motion.valid)
    one, other = (
        create_detector("exact", *args).detect(m, faces=True) for args, m in (((bodies,), motion), ((scaled,), bigger))
    )
    assert (one.verdict == Verdict.CONTACT).any()
    assert (one.digest, one.faces_digest) == (other.digest, other.faces_digest)


@pytest.mark.parametrize("lift", [0.0, *LIFTS, *(-lift for lift in LIFTS)])
def test_41_a_glass_on_a_table_lifted_or_sunk_by_a_hair_equals_the_exhaustive_test(lift):
    bodies = glass_on_table(lift)
    counts = equals_exhaustive(bodies, in_worlds(bodies, 6, seed=3))
    assert (counts[0] > 0) == (lift <= 0)


def resting_outcomes(lift, detector):
    bodies = tuple(glass_on_table(lift))
    motion = in_worlds(bodies, 20, seed=1)
    pairs = np.array([[0, 1]])
    exact = create_detector("exact", bodies, pairs=pairs)
    truth, said = exact.detect(motion), create_detector(detector, bodies, pairs=pairs).detect(motion)
    nothing = np.zeros(len(motion), dtype=np.int64)
    assembly = Assembly(bodies, motion, pairs, np.zeros(1, bool), nothing, np.ones((len(motion), 2), np.uint8))
    tolerance = Tolerance(assembly, lambda part: exact.detect(part, faces=True))
    outcome = compare(said, truth, within=tolerance.judge(said, truth)).outcome[:, 0]
    return truth, [Outcome(value) for value in outcome.tolist()]


@pytest.mark.parametrize("lift", [0.0, 1e-12, 1e-9, 5e-7, -1e-12, -1e-9, -5e-7])
def test_41_what_python_fcl_says_otherwise_of_resting_glass_is_within_tolerance(lift):
    _, outcome = resting_outcomes(lift, "hybrid")
    assert not {Outcome.MISSED, Outcome.INVENTED} & set(outcome)


def test_41_python_fcl_does_say_otherwise():
    outcomes = [word for lift in (0.0, 1e-16, -1e-16) for word in resting_outcomes(lift, "hybrid")[1]]
    assert outcomes.count(Outcome.WITHIN_TOLERANCE) > 0


@pytest.mark.parametrize("lift", [1e-4, -1e-4])
def test_41_a_tenth_of_a_millimetre_away_from_touching_all_agree(lift):
    truth, outcome = resting_outcomes(lift, "hybrid")
    assert set(outcome) == ({Outcome.NEITHER} if lift > 0 else {Outcome.BOTH})
    assert ((truth.verdict == Verdict.CONTACT) == (lift < 0)).all()


def test_42_a_mesh_on_itself_meets_itself_in_every_face():
    mesh = beaker_mesh(sides=10)
    bodies = [Body("one", mesh), Body("other", mesh)]
    assert min(equals_exhaustive(bodies, in_worlds(bodies, 4, seed=5))) >= len(mesh.faces)
    faces = intersecting_faces(mesh, mesh)
    own = set(range(len(mesh.faces)))
    assert {a for a, b in faces.tolist() if a == b} == own


def test_42_octahedra_kissing_at_a_vertex_meet_in_every_pair_of_the_faces_there():
    corners = np.concatenate([np.eye(3), -np.eye(3)])
    faces = [[a, b, c] for a in (0, 3) for b in (1, 4) for c in (2, 5)]
    one, other = (TriangleMesh(corners + np.array([x, 0, 0]), faces) for x in (0.0, 2.0))
    assert len(intersecting_faces(one, other)) == 16
    bodies = [Body("one", one), Body("other", other)]
    assert equals_exhaustive(bodies, in_worlds(bodies, 12, seed=6))[0] == 16


def test_42_icospheres_kissing_at_a_vertex_of_six_faces_meet_in_36_pairs():
    one = icosphere_mesh(1)
    bodies = [Body("one", one), Body("other", moved(one, [0, 0, 2]))]
    assert len(intersecting_faces(one, bodies[1].mesh)) == 36
    assert equals_exhaustive(bodies, in_worlds(bodies, 12, seed=9))[0] == 36


def test_42_a_rod_leaning_on_a_wall_equals_the_exhaustive_test():
    rod = rod_mesh(0.25, 4.0, 8)
    wall = box_mesh((1.0, 6.0, 6.0), (0.25 + 0.5, 0, 2.0))
    bodies = [Body("rod", rod), Body("wall", wall)]
    assert equals_exhaustive(bodies, in_worlds(bodies, 12, seed=7))[0] > 0


def test_42_blocks_that_share_a_lattice_equal_the_exhaustive_test():
    blocks = merged(*(box_mesh(centre=(x, y, 0)) for x in range(3) for y in range(2)))
    bodies = [Body("one", blocks), Body("other", moved(blocks, [1, 1, 1]))]
    assert equals_exhaustive(bodies, in_worlds(bodies, 8, seed=8))[0] > 50


def test_43_threads_blocks_and_a_resumed_stream_give_the_same_digests():
    bodies, motion = lab(240, seed=4)
    whole = create_detector("exact", bodies).detect(motion, faces=True)
    for threads in (2, 3, 8):
        again = create_detector("exact", bodies, threads=threads).detect(motion, faces=True)
        assert (again.digest, again.faces_digest) == (whole.digest, whole.faces_digest)
    for size in (1, 64, 4096):
        joined = join(list(create_detector("exact", bodies).stream(motion.blocks(size), faces=True)))
        assert (joined.digest, joined.faces_digest) == (whole.digest, whole.faces_digest)
    first = list(create_detector("exact", bodies).stream(motion.frames(0, 100).blocks(64), faces=True))
    rest = list(create_detector("exact", bodies).stream(motion.frames(100, 240).blocks(64), faces=True))
    resumed = join([*first, *rest])
    assert (resumed.digest, resumed.faces_digest) == (whole.digest, whole.faces_digest)


DETECTORS_ON_MESHES = ["hybrid", "static", "discrete", "exact"]
CASES = {
    "ball .1 in a unit box": (ball_mesh(0.1), box_mesh()),
    "ball .2 in a ball of 1": (ball_mesh(0.2), ball_mesh(1.0)),
}


def seen(name, first, second, motion):
    return create_detector(name, [Body("first", first), Body("second", second)]).detect(motion)


def poses(world, count=12):
    rng = np.random.default_rng(int(world))
    turn, place = random_rotations(rng, count), rng.normal(size=(count, 3)) * world
    turn[0], place[0] = np.eye(3), 0.0
    return Motion(np.arange(count), np.repeat(place[:, None], 2, 1), np.repeat(turn[:, None], 2, 1))


@pytest.mark.parametrize("name", DETECTORS_ON_MESHES)
@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("world", [0.0, 1.0, 1e3])
@pytest.mark.parametrize("turned", [False, True], ids=["inner first", "outer first"])
def test_27_a_body_wholly_inside_another_is_contained(name, case, world, turned):
    inner, outer = CASES[case]
    detection = seen(name, *((outer, inner) if turned else (inner, outer)), poses(world))
    assert (detection.verdict == Verdict.CONTAINED).all()
    assert detection.containment == ("decided",)


@pytest.mark.parametrize("name", DETECTORS_ON_MESHES)
@pytest.mark.parametrize("world", [0.0, 1.0, 1e3])
@pytest.mark.parametrize("turned", [False, True], ids=["rod first", "beaker first"])
def test_28_a_rod_in_an_open_beaker_touches_nothing_and_is_not_contained(name, world, turned):
    rod, beaker = moved(rod_mesh(), [0.01, 0.005, 0.01]), beaker_mesh()
    detection = seen(name, *((beaker, rod) if turned else (rod, beaker)), poses(world))
    assert (detection.verdict == Verdict.CLEAR).all()
    assert detection.containment == ("decided",)


@pytest.mark.parametrize("name", DETECTORS_ON_MESHES)
def test_a_ball_that_moves_in_through_the_wall_is_clear_then_contact_then_contained(name):
    places = np.zeros((41, 2, 3))
    places[:, 0, 0] = 1.0125 - 0.025 * np.arange(41)
    motion = Motion(np.arange(41), places, np.tile(np.eye(3), (41, 2, 1, 1)))
    verdict = seen(name, ball_mesh(0.1), box_mesh(), motion).verdict[:, 0].tolist()
    # The wall is at .5 and the ball's extent along x is .1: contact from .6 to .4.
    expected = [Verdict.CLEAR] * 17 + [Verdict.CONTACT] * 8 + [Verdict.CONTAINED] * 16
    assert verdict == expected
