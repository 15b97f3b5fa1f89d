"""A session for timing, asked of our detectors and of plain loops over engines that know one pose at a time."""

import gc
from dataclasses import dataclass
from importlib import import_module
from time import perf_counter, process_time
from typing import Any

import numpy as np

from cdcore import Body, Motion, TriangleMesh, Verdict, create_detector
from replay.prepare.assemble import assemble
from sessions.model.constants import HEADSET_HZ
from sessions.synthetic.scenes import make_scene_session

EVERY_CONTACT = 4_000_000
APART_M = 5.0


@dataclass(frozen=True, eq=False)
class Workload:
    """Bodies with meshes (vertices, faces), their poses (T, N, 4, 4), body to world, and pairs (P, 2)."""

    names: tuple[str, ...]
    meshes: tuple[Any, ...]
    poses: np.ndarray
    pairs: np.ndarray
    rate_hz: float = HEADSET_HZ


def make_workload(faces, frames=5400, *, copies=1, distant=False):
    """The demo's minute at the bench, repeated, with meshes of nearly so many faces; copies of it stand side by side.

    ``distant``: every body stays 5 m away from the next.
    """
    minute = assemble(make_scene_session("bench-bumps", noise="off", faces=faces)[0])
    bodies, motion, count = minute.bodies, minute.motion, len(minute.bodies)
    poses = np.tile(np.eye(4), (len(motion), count, 1, 1))
    poses[..., :3, :3], poses[..., :3, 3] = motion.rotations, motion.translations
    poses = np.tile(poses[np.arange(frames) % len(poses)], (1, copies, 1, 1))
    poses[:, :, 0, 3] += APART_M * (np.arange(count * copies) if distant else np.repeat(np.arange(copies), count))
    pairs = np.concatenate([np.asarray(minute.pairs) + count * copy for copy in range(copies)])
    names = tuple(f"{body.name} {copy}" for copy in range(copies) for body in bodies)
    return Workload(names, tuple((body.mesh.vertices, body.mesh.faces) for body in bodies) * copies, poses, pairs)


class Own:
    """A detector by its whole public path: poses are checked in every call, trees kept, answers never.

    ``exact`` decides containment, which no peer does; it is no contact of surfaces and so not part of the answer.
    """

    def __init__(self, load, name="exact", **settings):
        self.load = load
        bodies = [Body(body, TriangleMesh(*mesh)) for body, mesh in zip(load.names, load.meshes, strict=True)]
        self.detector = create_detector(name, bodies, pairs=load.pairs, **settings)

    def motion(self):
        return Motion.from_matrices(np.arange(len(self.load.poses)) / self.load.rate_hz, self.load.poses)

    def staged(self, what):
        """Seconds of every stage, the check of the poses first, and the ``Detection``."""
        begin = perf_counter()
        motion = self.motion()
        checked = perf_counter() - begin
        found = self.detector.detect(motion, faces=what == "faces")
        return {"check": checked} | {name: float(np.sum(spent)) for name, spent in found.seconds.items()}, found

    def ask(self, what):
        """Distinct face pairs in every frame (T, P), or 0 and 1."""
        found = self.staged(what)[1]
        return found.face_counts if what == "faces" else (found.verdict == Verdict.CONTACT).view(np.int8)


class Candidate:
    """``exact`` for ``peers.py --candidate support.bench_engines:run``, with ``tests`` on the path."""

    engine = None

    def __call__(self, workload, what):
        if self.engine is None or self.engine.load.meshes is not workload.meshes:
            self.engine = Own(workload)
        self.engine.load = workload
        return self.engine.ask(what)


run = Candidate()


class FacePairs:
    """Stands in for ``fcl.CollisionResult``: keeps the faces of each contact, not the contact with its arrays."""

    def __init__(self):
        self.is_collision, self.cost_sources, self.contacts, self.faces = False, [], self, []

    def append(self, contact):
        self.faces.append((contact.b1, contact.b2))


class FclLoop:
    """python-fcl: the yardstick of time and of answers."""

    def __init__(self, load):
        self.load, self.fcl = load, import_module("fcl")
        self.things = [self.fcl.CollisionObject(self.tree(*mesh)) for mesh in load.meshes]
        for body, pose in enumerate(load.poses[0]):
            self.place(body, pose)

    def ask(self, what):
        """Every pair in every frame."""
        faces, asked, collide = what == "faces", self.load.pairs.tolist(), self.fcl.collide
        request = self.fcl.CollisionRequest(num_max_contacts=EVERY_CONTACT if faces else 1, enable_contact=False)

        def fill(row):
            for k, (i, j) in enumerate(asked):
                found = FacePairs()
                if collide(self.things[i], self.things[j], request, found):
                    row[k] = len(set(found.faces)) if faces else 1

        return frame_by_frame(self.load, self.place, fill)

    def place(self, body, pose):
        self.things[body].setRotation(pose[:3, :3])
        self.things[body].setTranslation(pose[:3, 3])

    def tree(self, vertices, faces):
        tree = self.fcl.BVHModel()
        tree.beginModel(num_tris_=len(faces), num_vertices_=len(vertices))
        tree.addSubModel(vertices, faces.tolist())
        tree.endModel()
        return tree


class TrimeshLoop:
    """The collision manager of trimesh, python-fcl below it; a convex mesh becomes a solid, whose faces it cannot name.

    Bodies are placed by ``set_transform``: ``add_object`` rounds to single precision.
    """

    def __init__(self, load):
        self.load = load
        self.manager = import_module("trimesh.collision").CollisionManager()
        mesh_of = import_module("trimesh").Trimesh
        for name, (vertices, faces), pose in zip(load.names, load.meshes, load.poses[0], strict=True):
            self.manager.add_object(name, mesh_of(vertices, faces, process=False))
            self.manager.set_transform(name, pose)
        self.column = {frozenset((load.names[i], load.names[j])): k for k, (i, j) in enumerate(load.pairs.tolist())}

    def ask(self, what):
        """All bodies in every frame: the manager has its own broad phase."""
        manager, names, column = self.manager, self.load.names, self.column

        def place(body, pose):
            manager.set_transform(names[body], pose)

        def fill(row):
            if what == "faces":
                contacts = manager.in_collision_internal(return_data=True)[1]
                found = {(*sorted(c.names), *(c.index(name) for name in sorted(c.names))) for c in contacts}
            else:
                found = set(manager.in_collision_internal(return_names=True)[1])
            for a, b, *_ in found:
                if frozenset((a, b)) in column:
                    row[column[frozenset((a, b))]] += 1

        return frame_by_frame(self.load, place, fill)


def frame_by_frame(load, place, fill):
    """The plain loop: in every frame place what moves, then fill the answers of all pairs (P,)."""
    counts = np.zeros((len(load.poses), len(load.pairs)), dtype=np.int64)
    moving = np.flatnonzero((load.poses != load.poses[:1]).any(axis=(0, 2, 3))).tolist()
    for row, poses in zip(counts, load.poses, strict=True):
        for body in moving:
            place(body, poses[body])
        fill(row)
    return counts


YARDSTICK = "python-fcl"
SURFACES = "exact without containment"
ENGINES = {
    YARDSTICK: FclLoop, "trimesh": TrimeshLoop, "exact": Own, SURFACES: lambda load: Own(load, containment=False),
    "hybrid": lambda load: Own(load, "hybrid"),
}  # fmt: skip


def seconds(call):
    """Processor time of a call without the cyclic garbage collector: all engines have one thread."""
    gc.collect()
    gc.disable()
    try:
        begin = process_time()
        call()
        return process_time() - begin
    finally:
        gc.enable()
