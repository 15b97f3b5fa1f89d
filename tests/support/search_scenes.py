"""Meshes in contact for searches and kernels: thousands of faces with the exact answer, and blocks of eight frames."""

from functools import cache

import numpy as np
from support.processes import kernels_in_python
from support.random_worlds import face_soup, motion_of, placed
from support.shapes import ball_mesh, random_rotations, shared

from cdcore import Body, Motion, TriangleMesh, Verdict, create_detector, intersecting_faces
from cdcore.kernels import memory
from cdcore.kernels.memory import address_of, layout
from cdcore.narrow.bvh import tree_memory
from cdcore.narrow.bvh.bounds import position_pad
from cdcore.narrow.bvh.box_tree import build_box_trees
from cdcore.narrow.bvh.traverse import fill_relative
from cdcore.narrow.bvh.tree_memory import DOUBLES, Pair, Scratch
from cdcore.narrow.bvh.whole_motion import SegmentSearch
from cdcore.search.features import features_of, sample_of
from cdcore.search.pair_search import PairSearch
from cdcore.search.search_settings import SearchSettings

I3 = np.eye(3)
NO_SEEDS = np.zeros((0, 2), dtype=np.int64)


@shared
def torus_mesh(major=1.0, minor=0.3, around=40, across=20):
    """A closed torus about z of 2 x around x across faces."""
    u, v = (2 * np.pi * np.arange(n) / n for n in (around, across))
    ring = major + minor * np.cos(v)
    points = np.stack(
        [np.cos(u)[:, None] * ring, np.sin(u)[:, None] * ring, np.tile(minor * np.sin(v), (around, 1))], axis=-1
    )
    k, m = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    corner = [((k + a) % around) * across + (m + b) % across for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
    faces = [np.stack([corner[0], corner[x], corner[x + 1]], axis=-1).reshape(-1, 3) for x in (1, 2)]
    return TriangleMesh(points.reshape(-1, 3), np.concatenate(faces))


def ball_of(faces, radius=1.0):
    """A ball of roughly this many faces."""
    rings = round((faces / 4) ** 0.5) + 1
    return ball_mesh(radius, rings=rings, sides=2 * rings)


def search_of(mesh_a, mesh_b, names=("a", "b"), draw=0, **settings):
    """A search over two meshes; ``draw``: the seed of samples."""
    of_each = zip((mesh_a, mesh_b), names, strict=True)
    features = [sample_of(features_of(mesh), settings.get("samples"), draw, name) for mesh, name in of_each]
    return PairSearch(*features, names, SearchSettings(**settings))


def matrix(pose):
    """A pose of rotation and translation as 4x4."""
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = pose
    return out


def exact_pairs(search, mesh_a, mesh_b, pose_a, pose_b):
    """Face pairs that meet, as places in the order of the search."""
    faces = intersecting_faces(mesh_a, mesh_b, matrix(pose_a), matrix(pose_b))
    indices = []
    for features, column in ((search.first, faces[:, 0]), (search.second, faces[:, 1])):
        index = np.empty(len(features), dtype=np.int64)
        index[features.face] = np.arange(len(features))
        indices.append(index[column].tolist())
    return set(zip(*indices, strict=True))


@cache
def colliding_poses(mesh_a, mesh_b, count, seed):
    """Random poses of A around B, which stands at the origin: the first so many at which the surfaces meet."""
    rng = np.random.default_rng(seed)
    bodies = [Body("a", mesh_a), Body("b", mesh_b)]
    detector = create_detector("exact", bodies, containment=False)
    size = np.linalg.norm(mesh_a.vertices, axis=1).max() + np.linalg.norm(mesh_b.vertices, axis=1).max()
    result = []
    tried = 8 * count
    while len(result) < count:
        rotation, direction = random_rotations(rng, tried), rng.normal(size=(tried, 3))
        move = direction / np.linalg.norm(direction, axis=1)[:, None] * (size * rng.uniform(0.3, 1.0, (tried, 1)))
        rotations = np.stack([rotation, np.broadcast_to(I3, rotation.shape)], axis=1)
        motion = Motion(np.arange(tried), np.stack([move, np.zeros_like(move)], axis=1), rotations)
        meet = detector.detect(motion).verdict[:, 0] == Verdict.CONTACT
        result += list(zip(rotation[meet], move[meet], strict=True))
    return result[:count]


ROOM = 4096


def relative_of(row, scratch):
    """Fill eight poses of the first pair, relative to each other, without the compiler."""
    with kernels_in_python():
        pair = tree_memory.pair_at(memory.integers_of(row), 0)
        return fill_relative(pair, 0, 8, scratch)


def row_of_pair(trees, matrices, move):
    """Trees and poses of two bodies, as given, as the kernels take them, and what must be kept while they do."""
    search = SegmentSearch(trees, np.array([[0, 1]]), len(matrices), every=True)
    search.tracks.fill(matrices, move, np.ones((len(matrices), 2), dtype=bool))
    pair = search.rows.view(layout(Pair))[:, 0]
    for side, body in zip("ab", range(2), strict=True):
        pair[f"tree_{side}"] = address_of(trees[body].memory_row)
        pair[f"pose_{side}"] = search.tracks.addresses_of(np.array(body))
    return search.rows[0], search


class EightFrames:
    """``separation``: metres the first body is moved along x; ``grains``: large faces, bunches of tiny ones.

    ``faces``: of the two bodies, where there are no grains.
    """

    def __init__(self, seed, size=0.3, separation=0.0, grains=False, faces=(40, 60)):
        rng = np.random.default_rng(seed)
        self.meshes = [face_soup(rng, count=count, size=size) for count in faces]
        if grains:
            bunches = np.repeat(rng.uniform(-0.5, 0.5, (40, 1, 3)), 4, axis=0)
            self.meshes = [face_soup(rng, count=4, size=2.0), bunches + rng.normal(size=(160, 3, 3)) * 0.01]
        self.matrices, self.move = motion_of("soup", rng, 24, 2)
        self.move[:, 0, 0] += separation
        self.trees = build_box_trees(self.meshes)
        self.row, self._kept = row_of_pair(self.trees, self.matrices, self.move)
        self.pad = position_pad(sum(t.reach for t in self.trees) + np.linalg.norm(self.move, axis=2).max(0).sum(), 0.0)
        doubles, integers = [np.empty(size) for size in DOUBLES], np.zeros(ROOM, dtype=np.int64)
        candidates = np.empty(256, np.int64)
        self.scratch = Scratch(
            *doubles,
            integers,
            candidates,
            np.zeros(8, np.int64),
            integers,
            integers,
            integers,
            integers,
            keys_end=ROOM,
            later_end=ROOM,
        )
        self.relative, self.middle, self.candidates = (
            self.scratch.relative,
            self.scratch.middle,
            self.scratch.candidates,
        )
        self.chord = relative_of(self.row, self.scratch)

    def world(self, frame):
        return [placed(mesh, self.matrices[frame, k], self.move[frame, k]) for k, mesh in enumerate(self.meshes)]
