"""Plain loops over engines that know one pose at a time, as users write them: what moves is placed once a frame."""

import gc
from importlib import import_module
from importlib.util import find_spec
from time import process_time

import numpy as np
from support.bench_candidate import OwnExact

EVERY_CONTACT = 4_000_000


class FacePairs:
    """Stands in for ``fcl.CollisionResult``: keeps the faces of each contact, not the contact with its arrays."""

    def __init__(self):
        self.is_collision, self.cost_sources, self.contacts, self.faces = False, [], self, []

    def append(self, contact):
        self.faces.append((contact.b1, contact.b2))


class FclLoop:
    """python-fcl: the yardstick of time and of answers."""

    def __init__(self, load):
        self._load, self._fcl = load, import_module("fcl")
        self._things = [self._fcl.CollisionObject(self._tree(*mesh)) for mesh in load.meshes]
        for body, pose in enumerate(load.poses[0]):
            self._place(body, pose)

    def ask(self, what):
        """Every pair in every frame."""
        faces, asked, collide = what == "faces", self._load.pairs.tolist(), self._fcl.collide
        request = self._fcl.CollisionRequest(num_max_contacts=EVERY_CONTACT if faces else 1, enable_contact=False)

        def fill(row):
            for k, (i, j) in enumerate(asked):
                found = FacePairs()
                if collide(self._things[i], self._things[j], request, found):
                    row[k] = len(set(found.faces)) if faces else 1

        return frame_by_frame(self._load, self._place, fill)

    def _place(self, body, pose):
        self._things[body].setRotation(pose[:3, :3])
        self._things[body].setTranslation(pose[:3, 3])

    def _tree(self, vertices, faces):
        tree = self._fcl.BVHModel()
        tree.beginModel(num_tris_=len(faces), num_vertices_=len(vertices))
        tree.addSubModel(vertices, faces.tolist())
        tree.endModel()
        return tree


class CoalLoop:
    """coal: trees of oriented boxes, as python-fcl has them."""

    def __init__(self, load):
        self._load = load
        self._coal = import_module("coal")
        self._trees = [self._tree(*mesh) for mesh in load.meshes]
        self._placed = [self._pose(pose) for pose in load.poses[0]]

    def ask(self, what):
        """Every pair in every frame; with faces contacts are switched on, which coal needs to name them."""
        request, result, collide = self._coal.CollisionRequest(), self._coal.CollisionResult(), self._coal.collide
        request.num_max_contacts = EVERY_CONTACT if what == "faces" else 1
        request.enable_contact = what == "faces"
        trees, placed, asked = self._trees, self._placed, self._load.pairs.tolist()

        def place(body, pose):
            placed[body] = self._pose(pose)

        def fill(row):
            for k, (i, j) in enumerate(asked):
                result.clear()
                if collide(trees[i], placed[i], trees[j], placed[j], request, result):
                    row[k] = len({(contact.b1, contact.b2) for contact in result.getContacts()})

        return frame_by_frame(self._load, place, fill)

    def _tree(self, vertices, faces):
        tree = self._coal.BVHModelOBBRSS()
        tree.beginModel(len(faces), len(vertices))
        tree.addVertices(vertices)
        tree.addTriangles(faces.astype(np.int64))
        tree.endModel()
        return tree

    def _pose(self, pose):
        return self._coal.Transform3s(pose[:3, :3], pose[:3, 3])


class TrimeshLoop:
    """The collision manager of trimesh, python-fcl below it; a convex mesh becomes a solid, whose faces it cannot name.

    Bodies are placed by ``set_transform``: ``add_object`` rounds to single precision.
    """

    def __init__(self, load):
        self._load = load
        self._manager = import_module("trimesh.collision").CollisionManager()
        mesh_of = import_module("trimesh").Trimesh
        for name, (vertices, faces), pose in zip(load.names, load.meshes, load.poses[0], strict=True):
            self._manager.add_object(name, mesh_of(vertices, faces, process=False))
            self._manager.set_transform(name, pose)
        self._column = {frozenset((load.names[i], load.names[j])): k for k, (i, j) in enumerate(load.pairs.tolist())}

    def ask(self, what):
        """All bodies in every frame: the manager has its own broad phase."""
        manager, names, column = self._manager, self._load.names, self._column

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

        return frame_by_frame(self._load, place, fill)


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
ENGINES = {YARDSTICK: FclLoop, "trimesh": TrimeshLoop, "exact": OwnExact}
if find_spec("coal"):
    ENGINES["coal"] = CoalLoop


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
