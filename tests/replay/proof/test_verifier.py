"""The verifier accepts what is true and rejects what is not; brute force, face against face, says which is which."""

import os
from functools import cache

import numpy as np
import pytest
from support.motions import degenerate, fan_of_shared_edges, grid_plate, lattice, soup, turned_by
from support.proofs import Truth, motion_of, proven
from support.small_worlds import cube

from cdcore import Body, Motion, TriangleMesh, triangles_intersect
from cdcore.errors import CollisionCoreError
from cdcore.narrow.containment.ray_parity import point_inside
from cdcore.numerics import place_points
from replay.proof.claims import Kind, Mesh, Proof, WrongRecord
from replay.proof.geometry import inside, meeting, placed, triangles_meet
from replay.proof.verifier import verify

FRAMES = 24
CLEAR, CONTACT, CONTAINED, NO_POSE = Kind
ALTERATIONS = int(os.environ.get("ALTERATIONS", "500"))
"""How many false claims are to be rejected: 500 in CI, 10,000 on demand."""
SHARES = 25


def loose(triangles):
    return TriangleMesh(triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3))


def box(edge):
    return TriangleMesh(cube(edge).vertices, cube(edge).faces)


def hollow(rng):
    """A closed shell: a cube of 4 with a hollow of 3."""
    out, hole = cube(4.0), cube(3.0)
    faces = np.concatenate([np.asarray(out.faces), np.asarray(hole.faces)[:, ::-1] + 8])
    return TriangleMesh(np.concatenate([out.vertices, hole.vertices]), faces)


MESHES = [
    lambda rng: loose(soup(rng)), lambda rng: loose(lattice(rng)), lambda rng: loose(degenerate(rng)),
    lambda rng: loose(fan_of_shared_edges(rng)), lambda rng: loose(grid_plate()),
    lambda rng: box(float(rng.uniform(0.5, 3))), lambda rng: box(1.0), hollow,
]  # fmt: skip


def world(seed, frames=FRAMES, kinds=MESHES):
    """Three bodies of any kind that drift, stand, touch on a lattice, lose their pose, or are thrown far away."""
    rng = np.random.default_rng(seed)
    bodies = [Body(name, kinds[rng.integers(len(kinds))](rng)) for name in "abc"]
    step = float(rng.choice([0, 0.05, 0.5]))
    stands = np.tile(np.eye(3), (frames, 1, 1))
    turns = np.stack([turned_by(rng, frames, step) if rng.random() < 0.6 else stands for _ in bodies], axis=1)
    places = np.cumsum(rng.normal(size=(frames, 3, 3)) * rng.choice([0.0, 0.02, 0.3, 1.0]), axis=0)
    places += rng.normal(size=(3, 3)) * rng.choice([0, 2, 6])
    if rng.random() < 0.3:
        places = np.round(places * 4) / 4
    if rng.random() < 0.2:
        places += 1000
    if rng.random() < 0.1:
        places[frames // 4, 1] = 1e12
    if rng.random() < 0.05:
        places[frames // 3] = 1e15
    return bodies, Motion(np.arange(frames) / 90, places, turns, rng.random((frames, 3)) > 0.05)


def accepted(seed):
    proof, meshes, poses, detection = proven(*world(seed))
    told = verify(Proof.read(proof.written()), meshes, poses)
    assert np.array_equal(proof.verdicts(FRAMES), detection.verdict)
    assert told["CLEAR"] + told["CONTACT"] + told["CONTAINED"] + told["NO_POSE"] == detection.verdict.size
    return told


def test_it_accepts_random_motions():
    told = sum((accepted(seed) for seed in range(6)), start=accepted(28))
    assert min(told[word] for word in ("CLEAR", "CONTACT", "CONTAINED", "NO_POSE", "boxes", "rays")) > 0


@pytest.mark.slow
@pytest.mark.parametrize("share", range(10))
def test_it_accepts_five_hundred_random_motions(share):
    for seed in range(50 * share, 50 * share + 50):
        accepted(seed)


def changed(proof, **tables):
    return Proof(proof.header, {**proof.arrays, **{name.replace("_of_", "/"): table for name, table in tables.items()}})


@cache
def small(seed):
    """A world small enough to ask every face, its proof, and what is true of it."""
    kinds = [lambda rng: box(1.0), lambda rng: box(3.0), lambda rng: loose(soup(rng, 10)), hollow]
    bodies, motion = world(seed, 10, kinds)
    return (bodies, motion, *proven(bodies, motion)[:3])


def altered(rng, seed):
    """A proof, or the poses or a mesh it speaks of, changed in one place: (bodies, motion, proof, poses)."""
    bodies, motion, proof, _, poses = small(seed)
    what = rng.integers(7)
    if what < 4:
        return bodies, motion, CHANGES[what](rng, proof), poses
    if what == 4:
        name = rng.choice([key for key in proof.arrays if proof.arrays[key].size and not key.startswith("given")])
        table = proof[name].copy()
        flat = table.reshape(-1)
        place = rng.integers(len(flat))
        flat[place] = rng.choice([flat[rng.integers(len(flat))], flat[place] + 1, 0])
        return bodies, motion, changed(proof, **{name.replace("/", "_of_"): table}), poses
    if what == 5:
        frame, body = rng.integers(poses.valid.shape[0]), rng.integers(3)
        poses = poses._replace(translation=poses.translation.copy(), valid=poses.valid.copy())
        if rng.random() < 0.2:
            poses.valid[frame, body] ^= True
        poses.translation[frame, body] += rng.normal(size=3) * rng.choice([0.01, 0.3, 3])
        return bodies, motion_of(motion, poses), proof, poses
    body = rng.integers(3)
    mesh = bodies[body].mesh
    vertices = mesh.vertices.copy()
    vertices[rng.integers(len(vertices))] += rng.normal(size=3) * rng.choice([0.1, 2])
    others = [Body(one.name, TriangleMesh(vertices, mesh.faces)) if k == body else one for k, one in enumerate(bodies)]
    return others, motion, proof, poses


def change_a_verdict(rng, proof):
    claims = proof["claims"].copy()
    row = rng.integers(len(claims))
    claims[row, 3] = rng.choice([CLEAR, CONTACT, CONTAINED, NO_POSE])
    if rng.random() < 0.7:
        claims[row, 4:] = claims[rng.integers(len(claims)), 4:]
    if rng.random() < 0.3:
        claims[row, 5:] = rng.integers(0, 12, 2)
    return changed(proof, claims=claims)


def move_a_border(rng, proof):
    claims = proof["claims"].copy()
    row = rng.integers(len(claims) - 1)
    by = rng.integers(-3, 4)
    claims[row, 2] += by
    claims[row + 1, 1] += by
    return changed(proof, claims=claims)


def join_claims(rng, proof):
    claims = proof["claims"].copy()
    row = rng.integers(len(claims) - 1)
    if claims[row, 0] == claims[row + 1, 0]:
        claims[row, 2] = claims[row + 1, 2]
        claims = np.delete(claims, row + 1, axis=0)
    return changed(proof, claims=claims)


def cut_a_walk_short(rng, proof):
    """A front becomes one letter, and a contact is called clear by it."""
    claims, ends = proof["claims"].copy(), proof["front_ends"]
    letter = rng.choice([*b"XF"])
    row = rng.integers(len(claims))
    claims[row, 3:] = rng.choice([CLEAR, CONTAINED]), len(ends), *claims[row, 5:]
    fronts = np.append(proof["fronts"], np.uint8(letter))
    return changed(proof, claims=claims, fronts=fronts, front_ends=np.append(ends, len(fronts)))


CHANGES = [change_a_verdict, move_a_border, join_claims, cut_a_walk_short]


@pytest.mark.parametrize("share", range(SHARES))
def test_it_rejects_every_alteration_that_makes_a_claim_false(share):
    rng, rejected, truths = np.random.default_rng((22, share)), 0, {}
    while rejected < ALTERATIONS // SHARES:
        seed = int(rng.integers(8)) + 8 * share
        try:
            bodies, motion, proof, poses = altered(rng, seed)
        except CollisionCoreError:
            continue
        same = bodies is small(seed)[0] and motion is small(seed)[1]
        truth = truths.setdefault(seed, Truth(bodies, motion)) if same else Truth(bodies, motion)
        if truth.holds(proof):
            continue
        with pytest.raises(WrongRecord):
            verify(proof, [Mesh(body.mesh.vertices, body.mesh.faces) for body in bodies], poses)
        rejected += 1


def test_what_says_why_is_checked_too():
    """A walk that leaves faces out, opens a leaf or goes on, a tree without a face, axes that are none."""
    _, _, proof, meshes, poses = small(0)
    walks = proof["fronts"].tobytes()
    assert {*walks} <= {*b"XFAB"}
    for words, wrong in {"goes on": walks.translate(bytes.maketrans(b"AB", b"XX")), "opens": b"A" * len(walks)}.items():
        with pytest.raises(WrongRecord, match=words):
            verify(changed(proof, fronts=np.frombuffer(wrong, np.uint8)), meshes, poses)
    with pytest.raises(WrongRecord, match="every face once"):
        verify(changed(proof, faces_of_0=np.zeros_like(proof["faces/0"])), meshes, poses)
    with pytest.raises(WrongRecord, match="no axes"):
        verify(changed(proof, axes_of_0=np.zeros_like(proof["axes/0"])), meshes, poses)
    with pytest.raises(WrongRecord, match="no rotation"):
        verify(proof, meshes, poses._replace(rotation=1.001 * poses.rotation))


def pairs_of(kind, rng):
    if kind == "any":
        return rng.random((2000, 2, 3, 3))
    if kind == "lattice":
        return lattice(rng, 600).reshape(-1, 2, 3, 3)
    if kind == "flat":
        return np.concatenate([rng.integers(-9, 9, (300, 2, 3, 2)), np.zeros((300, 2, 3, 1))], axis=3)
    if kind == "points and segments":
        return np.concatenate([degenerate(rng) for _ in range(20)]).reshape(-1, 2, 3, 3)
    if kind == "tiny":
        return (rng.random((300, 2, 3, 3)) - 0.5) * 2.0**-500
    return (rng.random((300, 2, 3, 3)) - 0.5) * 2.0**400


@pytest.mark.parametrize("kind", ["any", "lattice", "flat", "points and segments", "tiny", "huge"])
def test_two_triangles_meet_where_the_core_says_so(kind):
    pairs = np.ascontiguousarray(pairs_of(kind, np.random.default_rng(7)))
    assert np.array_equal(meeting(pairs[:, 0], pairs[:, 1])[0], triangles_intersect(pairs))


@pytest.mark.parametrize("kind", ["any", "lattice", "points and segments"])
def test_integers_alone_agree_with_the_filter(kind):
    pairs = pairs_of(kind, np.random.default_rng(8))[:200]
    answer, _ = meeting(pairs[:, 0], pairs[:, 1])
    assert [triangles_meet(a, b) for a, b in pairs] == answer.tolist()


def test_points_are_inside_where_the_core_says_so_corners_and_edges_in_the_way_included():
    mesh = cube(2.0)
    surface = np.asarray(mesh.vertices)[np.asarray(mesh.faces)]
    grid = np.stack(np.meshgrid(*[[-1.5, -0.5, 0.0, 0.25, 0.5, 1.5]] * 3), axis=-1).reshape(-1, 3)
    assert [inside(point, surface) for point in grid] == [point_inside(point, surface) for point in grid]
    assert sum(inside(point, surface) for point in grid) == 4**3


def test_points_are_placed_to_the_bit_as_the_reference_vertices():
    rng = np.random.default_rng(0)
    points, turn, place = rng.normal(size=(50, 3)), rng.normal(size=(3, 3)), rng.normal(size=3)
    assert np.array_equal(placed(points, turn, place), place_points(points, turn, place))
