"""The engines that race: each is built for a session and decides all its pair-frames in one call.

The three peers are loops of Python over an engine that knows one pose at a time, as their users write them: bodies that
move are placed once a frame, then every pair is asked.
"""

from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec
from time import perf_counter
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from cdcore import Body, Detection, Motion, TriangleMesh, Verdict, create_detector
from cdcore.narrow.fcl_meshes import FclMeshes
from cdcore.numerics import FloatArray, Int32Array, IntArray
from replay.studies.bench.workload import BenchWorkload

Answer = IntArray | NDArray[np.int8]
"""(T, P) distinct face pairs, or 0 and 1."""
EVERY_CONTACT: Final = 4_000_000


class FclLoop:
    """python-fcl: the yardstick of time and of answers."""

    def __init__(self, load: BenchWorkload) -> None:
        self._load = load
        self._meshes = FclMeshes([TriangleMesh(*mesh) for mesh in load.meshes])

    def ask(self, what: str) -> Answer:
        """Every pair in every frame."""
        poses = self._load.poses
        turns, places = poses[..., :3, :3].copy(), poses[..., :3, 3].copy()
        return self._meshes.counts_along(self._load.pairs, turns, places, faces=what == "faces")


class CoalLoop:
    """coal: trees of oriented boxes, as python-fcl has them."""

    def __init__(self, load: BenchWorkload) -> None:
        self._load = load
        self._coal: Any = import_module("coal")
        self._trees = [self._tree(*mesh) for mesh in load.meshes]
        self._placed = [self._pose(pose) for pose in load.poses[0]]

    def ask(self, what: str) -> Answer:
        """Every pair in every frame; with faces contacts are switched on, which coal needs to name them."""
        request, result, collide = self._coal.CollisionRequest(), self._coal.CollisionResult(), self._coal.collide
        request.num_max_contacts = EVERY_CONTACT if what == "faces" else 1
        request.enable_contact = what == "faces"
        trees, placed, asked = self._trees, self._placed, self._load.pairs.tolist()

        def place(body: int, pose: FloatArray) -> None:
            placed[body] = self._pose(pose)

        def fill(row: Answer) -> None:
            for k, (i, j) in enumerate(asked):
                result.clear()
                if collide(trees[i], placed[i], trees[j], placed[j], request, result):
                    row[k] = len({(contact.b1, contact.b2) for contact in result.getContacts()})

        return frame_by_frame(self._load, place, fill)

    def _tree(self, vertices: FloatArray, faces: Int32Array) -> Any:
        tree = self._coal.BVHModelOBBRSS()
        tree.beginModel(len(faces), len(vertices))
        tree.addVertices(vertices)
        tree.addTriangles(faces.astype(np.int64))
        tree.endModel()
        return tree

    def _pose(self, pose: FloatArray) -> Any:
        return self._coal.Transform3s(pose[:3, :3], pose[:3, 3])


class TrimeshLoop:
    """The collision manager of trimesh, python-fcl below it; a convex mesh becomes a solid, whose faces it cannot name.

    Bodies are placed by ``set_transform``: ``add_object`` rounds to single precision.
    """

    def __init__(self, load: BenchWorkload) -> None:
        self._load = load
        self._manager = import_module("trimesh.collision").CollisionManager()
        mesh_of: Any = import_module("trimesh").Trimesh
        for name, (vertices, faces), pose in zip(load.names, load.meshes, load.poses[0], strict=True):
            self._manager.add_object(name, mesh_of(vertices, faces, process=False))
            self._manager.set_transform(name, pose)
        self._column = {frozenset((load.names[i], load.names[j])): k for k, (i, j) in enumerate(load.pairs.tolist())}

    def ask(self, what: str) -> Answer:
        """All bodies in every frame: the manager has its own broad phase."""
        manager, names, column = self._manager, self._load.names, self._column

        def place(body: int, pose: FloatArray) -> None:
            manager.set_transform(names[body], pose)

        def fill(row: Answer) -> None:
            if what == "faces":
                contacts = manager.in_collision_internal(return_data=True)[1]
                found = {(*sorted(c.names), *(c.index(name) for name in sorted(c.names))) for c in contacts}
            else:
                found = set(manager.in_collision_internal(return_names=True)[1])
            for a, b, *_ in found:
                if frozenset((a, b)) in column:
                    row[column[frozenset((a, b))]] += 1

        return frame_by_frame(self._load, place, fill)


class OwnExact:
    """The detector ``exact`` by default settings: poses checked in every call, trees kept, answers never.

    Containment is decided, which no peer does; it is no contact of surfaces and so not part of the answer.
    """

    def __init__(self, load: BenchWorkload) -> None:
        self.load = load
        bodies = [Body(name, TriangleMesh(*mesh)) for name, mesh in zip(load.names, load.meshes, strict=True)]
        self._detector = create_detector("exact", bodies, pairs=load.pairs)

    def staged(self, what: str) -> tuple[dict[str, float], Detection]:
        """Seconds of every stage, the check of the poses first, and the ``Detection``."""
        begin = perf_counter()
        times = np.arange(len(self.load.poses)) / self.load.rate_hz
        motion = Motion.from_matrices(times, self.load.poses)
        checked = perf_counter() - begin
        found = self._detector.detect(motion, faces=what == "faces")
        return {"check": checked} | {name: float(np.sum(spent)) for name, spent in found.seconds.items()}, found

    def ask(self, what: str) -> Answer:
        """Every pair in every frame."""
        found = self.staged(what)[1]
        return found.face_counts if what == "faces" else (found.verdict == Verdict.CONTACT).view(np.int8)


def frame_by_frame(
    load: BenchWorkload, place: Callable[[int, FloatArray], None], fill: Callable[[Answer], None]
) -> Answer:
    """The plain loop: in every frame place what moves, then fill the answers of all pairs (P,)."""
    counts = np.zeros((len(load.poses), len(load.pairs)), dtype=np.int64)
    moving = np.flatnonzero((load.poses != load.poses[:1]).any(axis=(0, 2, 3))).tolist()
    for row, poses in zip(counts, load.poses, strict=True):
        for body in moving:
            place(body, poses[body])
        fill(row)
    return counts


YARDSTICK: Final = "python-fcl"
ENGINES: Final[dict[str, Callable[[BenchWorkload], Any]]] = {
    YARDSTICK: FclLoop, "coal": CoalLoop, "trimesh": TrimeshLoop, "exact": OwnExact,
}  # fmt: skip
OPTIONAL: Final = ("coal",)
"""Engines that come with the extra ``peers``."""


def installed_engines() -> list[str]:
    """The engines that can race on this machine."""
    return [name for name in ENGINES if name not in OPTIONAL or find_spec(name) is not None]
