"""The face pairs that meet in random and adversarial worlds, decided in integers and compared with the detectors.

``python tests/oracles/integer_worlds.py --count 20000`` draws that many worlds and prints every answer of a detector
that differs. Nothing here calls the code under test: NumPy comparisons dismiss face pairs whose boxes are apart, a
float filter of its own keeps what it is certain of, and whole numbers decide the rest, exactly.

The exact test looks for a direction that separates the two triangles. The nearest points of two disjoint convex bodies
lie on an edge of each, on a corner and a face, on a corner and an edge, or on two corners; the vector between them
separates the bodies and is one of 38 candidates. So the triangles meet where no candidate separates them, triangles
without area included.
"""

import argparse
import sys
from dataclasses import dataclass
from itertools import islice, product
from pathlib import Path
from time import process_time

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parents[2]))

from oracles.brute_force import placed
from support.random_worlds import SHAPES, World, random_world

from cdcore import Motion, Verdict, create_detector
from cdcore.protocol import detect_live

COMPLETE = ("exact", "aabb", "obb", "rapid-style", "solid-style")
"""Detectors that promise every face pair that meets."""
FRAMES = 4
ROUNDOFF = 2.0**-53
GENERIC_DIRECTIONS = 11
"""Normals and products of edges: they suffice for triangles with areas in different planes."""
NO_EXPONENT = 1 << 20
"""Above the exponent of every double."""
SMALL_BITS = 13
"""Coordinates of so many bits keep every product of the exact test within 64 bits."""
NUDGES = (0.0, 1.0, -1.0, 2.0)
"""Steps of rounding by which a body misses another one in the frames of an adversarial world."""
PAIRS = ((0, 1), (0, 2), (1, 2))


# ---- Exact: whole numbers, columns of int64 or of Python's integers


def subtract(p, q):
    """p - q; points are three columns of numbers."""
    return tuple(a - b for a, b in zip(p, q, strict=True))


def cross(p, q):
    """p x q."""
    return p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]


def dot(p, q):
    """p . q."""
    return p[0] * q[0] + p[1] * q[1] + p[2] * q[2]


def edges_of(triangle):
    """The three edges of a triangle, corner to next corner."""
    return [subtract(triangle[(k + 1) % 3], triangle[k]) for k in range(3)]


def candidate_directions():
    """Yield functions of two triangles that compute one candidate direction each; first the eleven that most need."""
    yield lambda a, b: cross(*edges_of(a)[:2])
    yield lambda a, b: cross(*edges_of(b)[:2])
    for i in range(3):
        for j in range(3):
            yield lambda a, b, i=i, j=j: cross(edges_of(a)[i], edges_of(b)[j])
    for i in range(3):
        for j in range(3):
            yield lambda a, b, i=i, j=j: across_edge(edges_of(a)[i], subtract(b[j], a[i]))
            yield lambda a, b, i=i, j=j: across_edge(edges_of(b)[i], subtract(a[j], b[i]))
            yield lambda a, b, i=i, j=j: subtract(b[j], a[i])


def across_edge(edge, to_corner):
    """The part of the vector to a corner that is perpendicular to an edge, times the squared length of the edge."""
    return cross(edge, cross(to_corner, edge))


def separated_along(direction, first, second):
    """Rows in which all of the first triangle lies before, or all of it behind, all of the second."""
    a = [dot(direction, corner) for corner in first]
    b = [dot(direction, corner) for corner in second]
    a_least, a_most = np.minimum(np.minimum(*a[:2]), a[2]), np.maximum(np.maximum(*a[:2]), a[2])
    b_least, b_most = np.minimum(np.minimum(*b[:2]), b[2]), np.maximum(np.maximum(*b[:2]), b[2])
    return ((a_most < b_least) | (b_most < a_least)).astype(bool)


def meet_in_integers(numbers):
    """Whether the triangles of each pair meet; ``numbers`` (n, 2, 3, 3) int64 or Python's integers."""
    meets = np.ones(len(numbers), dtype=bool)
    for direction_of in candidate_directions():
        rows = np.flatnonzero(meets)
        if not len(rows):
            break
        first, second = ([tuple(corner) for corner in side] for side in np.moveaxis(numbers[rows], 0, -1))
        meets[rows] = ~separated_along(direction_of(first, second), first, second)
    return meets


def meet_exactly(pairs):
    """Whether the triangles of each pair of finite doubles (n, 2, 3, 3) meet; a power of two per pair changes nothing.

    A double is a whole number times a power of two; without its trailing zeros that number is small on lattices.
    """
    mantissa, exponent = np.frexp(pairs)
    whole = np.ldexp(mantissa, 53).astype(np.int64)
    lowest_bit = np.where(whole == 0, 1, whole & -whole)
    whole //= lowest_bit
    exponent = exponent - 53 + np.log2(lowest_bit.astype(float)).astype(np.int64)
    least = np.where(whole == 0, NO_EXPONENT, exponent).min(axis=(1, 2, 3), keepdims=True)
    shift = np.where(whole == 0, 0, exponent - least)
    small = (shift + np.log2(np.abs(whole) + 1.0) < SMALL_BITS).all(axis=(1, 2, 3))
    answer = np.empty(len(pairs), dtype=bool)
    answer[small] = meet_in_integers(whole[small] << shift[small])
    answer[~small] = meet_in_integers(whole[~small].astype(object) << shift[~small].astype(object))
    return answer


# ---- Certain: floats with a bound


def certainly_separate(pairs):
    """Pairs that some direction separates by more than rounding; directions may be rounded, sums have a bound."""
    first, second = ([corner.T for corner in side] for side in pairs.transpose(1, 2, 0, 3))
    middle = first[0]
    first, second = ([subtract(corner, middle) for corner in side] for side in (first, second))
    extent = np.max([np.abs(np.array(corner)).max(axis=0) for corner in first + second], axis=0)
    gap = np.zeros(len(pairs), dtype=bool)
    for direction_of in islice(candidate_directions(), GENERIC_DIRECTIONS):
        direction = direction_of(first, second)
        a, b = (np.array([dot(direction, corner) for corner in side]) for side in (first, second))
        bound = 32 * ROUNDOFF * np.abs(np.array(direction)).sum(axis=0) * extent + 1e-280
        gap |= (a.max(axis=0) + bound < b.min(axis=0) - bound) | (b.max(axis=0) + bound < a.min(axis=0) - bound)
    return gap


def certain_sign(p, q, r):
    """The sign of p . (q x r) where it is certain, else 0; operands are differences that were rounded once."""
    minors = [(q[(k + 1) % 3] * r[(k + 2) % 3], q[(k + 2) % 3] * r[(k + 1) % 3]) for k in range(3)]
    value = sum(p[k] * (minors[k][0] - minors[k][1]) for k in range(3))
    size = sum(np.abs(p[k]) * (np.abs(minors[k][0]) + np.abs(minors[k][1])) for k in range(3))
    return np.sign(value) * (np.abs(value) > 32 * ROUNDOFF * size + 1e-280)


def certainly_pierced(pairs):
    """Pairs of which an edge of the one certainly passes through the inside of the other."""
    sides = [[corner.T for corner in side] for side in pairs.transpose(1, 2, 0, 3)]
    pierced = np.zeros(len(pairs), dtype=bool)
    for edges, face in (sides, sides[::-1]):
        u, v = subtract(face[1], face[0]), subtract(face[2], face[0])
        height = [certain_sign(subtract(corner, face[0]), u, v) for corner in edges]
        for k in range(3):
            start, stop = edges[k], edges[(k + 1) % 3]
            crosses = height[k] * height[(k + 1) % 3] < 0
            along = subtract(stop, start)
            rotations = [
                certain_sign(along, subtract(face[j], start), subtract(face[(j + 1) % 3], start)) for j in range(3)
            ]
            pierced |= crosses & (np.abs(np.sum(rotations, axis=0)) == 3)
    return pierced


def meet(pairs):
    """Whether the two closed triangles of each pair (n, 2, 3, 3) of finite doubles meet, and how many took integers."""
    # A power of two changes no answer, where no coordinate loses a bit.
    exponent = np.frexp(np.abs(pairs).max(axis=(1, 2, 3), keepdims=True))[1]
    near_item = np.ldexp(pairs, -exponent)
    whole = (np.ldexp(near_item, exponent) == pairs).all(axis=(1, 2, 3))
    answer = whole & certainly_pierced(near_item)
    undecided = ~answer & ~(whole & certainly_separate(near_item))
    answer[undecided] = meet_exactly(pairs[undecided])
    return answer, int(undecided.sum())


# ---- Worlds


def near(first, second):
    """Indices of faces (n, 2) whose boxes have a point in common."""
    lower_a, upper_a, lower_b, upper_b = first.min(axis=1), first.max(axis=1), second.min(axis=1), second.max(axis=1)
    overlap = (lower_a[:, None] <= upper_b[None]).all(axis=-1) & (lower_b[None] <= upper_a[:, None]).all(axis=-1)
    return np.argwhere(overlap)


@dataclass
class Answers:
    """Face pairs that meet, by frame and pair; ``None`` where a pose is missing."""

    faces: dict
    integers: int


def decide(world):
    """Every face pair of a world, frame by frame, in integers where floats cannot be certain."""
    motion, keys, rows, pairs = world.motion, {}, {}, []
    triangles = [body.mesh.triangles for body in world.bodies]
    for frame, (column, ends) in product(range(len(motion)), enumerate(PAIRS)):
        if not motion.valid[frame, list(ends)].all():
            continue
        poses = [(motion.rotations[frame, k], motion.translations[frame, k]) for k in ends]
        key = keys[frame, column] = column, *(array.tobytes() for pose in poses for array in pose)
        if key not in rows:
            first, second = (placed(triangles[k], *pose) for k, pose in zip(ends, poses, strict=True))
            rows[key] = near(first, second)
            pairs.append(np.stack([first[rows[key][:, 0]], second[rows[key][:, 1]]], axis=1))
    answer, integers = meet(np.concatenate([np.zeros((0, 2, 3, 3)), *pairs]))
    pieces = np.split(answer, np.cumsum([len(indices) for indices in rows.values()])[:-1])
    faces = {key: indices[piece] for (key, indices), piece in zip(rows.items(), pieces, strict=True)} if rows else {}
    frames = product(range(len(motion)), range(len(PAIRS)))
    return Answers({moment: faces[keys[moment]] if moment in keys else None for moment in frames}, integers)


def touching_world(seed):
    """An adversarial world: a corner of the second body lies on a point of the first, but for steps of rounding.

    The point is a corner of a face, one on an edge or one inside; both bodies may lie far from the origin.
    """
    rng = np.random.default_rng([seed, 77])
    world = random_world(3 * seed + 1, list(SHAPES)[seed % len(SHAPES)], frames=FRAMES)
    motion = world.motion
    moves, valid = motion.translations.copy(), np.ones_like(motion.valid)
    moves += rng.choice([0.0, 1.0, 1e3, 1e6]) * np.abs(moves).max() * rng.integers(-1, 2, 3)
    triangles = [body.mesh.triangles for body in world.bodies]
    for frame in range(FRAMES):
        face = placed(triangles[0][rng.integers(len(triangles[0]))], motion.rotations[frame, 0], moves[frame, 0])
        weights = [np.array([1.0, 0, 0]), np.array([0.5, 0.5, 0]), np.array([0.25, 0.25, 0.5])][rng.integers(3)]
        target = weights @ face
        corner = triangles[1][rng.integers(len(triangles[1])), rng.integers(3)]
        moves[frame, 1] = target - placed(corner[None], motion.rotations[frame, 1], np.zeros(3))[0]
        moves[frame, 1] += rng.choice(NUDGES) * np.spacing(moves[frame, 1])
    return World(world.bodies, Motion(motion.times, moves, motion.rotations, valid))


def world_of(seed):
    """Two of three worlds are random, the third is adversarial."""
    if seed % 3 == 2:
        return touching_world(seed)
    return random_world(seed, list(SHAPES)[seed // 3 % len(SHAPES)], frames=FRAMES)


def differences(world, names, live=()):
    """Answers of detectors that are not those of the integers, as texts, and how many face pairs took integers."""
    answers = decide(world)
    texts = []
    for name in names:
        detector = create_detector(name, world.bodies)
        with_faces = detector.detect(world.motion, faces=True)
        booleans = detector.detect(world.motion, faces=False)
        detections = [("faces", with_faces), ("booleans", booleans)]
        if name in live:
            detections.append(("live", detect_live(detector, world.motion)))
        for (frame, column), faces in answers.faces.items():
            for mode, detection in detections:
                verdict = Verdict(int(detection.verdict[frame, column]))
                if faces is None:
                    right = verdict is Verdict.NO_POSE
                else:
                    right = (verdict is Verdict.CONTACT) == (len(faces) > 0)
                if not right:
                    texts.append(f"{name} ({mode}) frame {frame} pair {column}: {verdict.name}")
            if faces is not None and not np.array_equal(with_faces.faces(frame, column), faces):
                texts.append(f"{name} frame {frame} pair {column}: other faces")
    return texts, answers.integers


def main():
    """Print what differs, and how many worlds and face pairs were decided in how much time."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=20_000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--detectors", nargs="+", default=["exact"])
    arguments = parser.parse_args()
    start, wrong, integers = process_time(), 0, 0
    for seed in range(arguments.first, arguments.first + arguments.count):
        texts, count = differences(world_of(seed), arguments.detectors)
        integers += count
        wrong += bool(texts)
        for text in texts:
            print(f"world {seed}: {text}", flush=True)
    seconds = process_time() - start
    print(f"{arguments.count} worlds, {wrong} differ, {integers:,} face pairs in integers, {seconds:.0f} s")
    return wrong > 0


if __name__ == "__main__":
    raise SystemExit(main())
