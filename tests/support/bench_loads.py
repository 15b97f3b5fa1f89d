"""Sessions for timing, and the loops over other engines that are timed beside `exact`.

The same arguments always give the same meshes and poses, and bodies touch in it. A tray, a cup, a ring and a bottle
stand; a rod stirs in the cup and knocks at its wall, a tube is put into the ring and leans on it, then pours over the
cup's rim, a hand touches bottle, cup and tray. Bodies are close for much of the time and touch in some 10 % of the
frames, which makes such a session hard. Positions, profiles and motions are rows of `tests/bench/loads.toml`. Meshes
have nearly the requested number of faces, none of them degenerate; corners are rounded to single precision, so that
engines of either precision see the same geometry.
"""

import gc
import tomllib
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from time import perf_counter, process_time

import numpy as np
from scipy.spatial.transform import Rotation

from cdcore import Body, Motion, TriangleMesh, Verdict, create_detector
from sessions import Scene, Session, Track
from sessions.model.constants import HEADSET_HZ
from sessions.synthetic.bench import Instruments, Placed
from sessions.synthetic.scenes import make_scene_session

TABLE = tomllib.loads((Path(__file__).parents[1] / "bench" / "loads.toml").read_text("utf-8"))
POSITIONS, PROFILES, KEYS = TABLE["places"], TABLE["profiles"], TABLE["keys"]
PERIOD = 30.0
STATION = ("cup", "rod", "ring", "tube", "bottle", "hand")
"""What follows the tray, again and again."""
STATION_STEP = 0.9
"""Metres from one station to the next."""
DISTANCE = 5.0
"""Metres between neighbouring bodies of a distant session."""
TREMOR = (0.0012, 0.02)
"""Largest amplitude in metres and radians."""
SLACK = (0.001, 0.03)
"""How far a seed moves a pose near something, metres an axis, and a pose in the air."""
TRAY_SIZE = (1.2, 0.7)


@dataclass(frozen=True, eq=False)
class BenchWorkload:
    """N meshes, their poses (T, N, 4, 4) and the pairs (P, 2) of which at least one body moves."""

    names: tuple
    meshes: tuple
    poses: np.ndarray
    pairs: np.ndarray
    rate_hz: float = HEADSET_HZ


def make_workload(faces, frames=5400, *, bodies=7, seed=0, distant=False):
    """Lay the bench: a tray, then stations of six ``bodies`` with nearly so many ``faces`` each.

    ``seed`` is of tremor, times and places. ``distant``: every body is 5 m from the next, and each moves as it does on
    the bench.
    """
    rng = np.random.default_rng(seed)
    kinds = ["tray"] + [STATION[k % len(STATION)] for k in range(bodies - 1)]
    shapes = {kind: mesh_of(kind, faces) for kind in dict.fromkeys(kinds)}
    poses = np.tile(np.eye(4), (frames, bodies, 1, 1))
    seconds = np.arange(frames) / HEADSET_HZ
    for body, kind in enumerate(kinds):
        if kind in KEYS:
            follow(KEYS[kind], seconds, rng, poses[:, body])
        else:
            poses[:, body, :3, 3] = POSITIONS[kind]
        poses[:, body, 0, 3] += DISTANCE * body if distant else STATION_STEP * (max(0, body - 1) // len(STATION))
    pairs = [(i, j) for i in range(bodies) for j in range(i + 1, bodies) if {kinds[i], kinds[j]} & set(KEYS)]
    names = tuple(f"{kind}-{k}" for k, kind in enumerate(kinds))
    return BenchWorkload(names, tuple(shapes[kind] for kind in kinds), poses, np.array(pairs, dtype=np.int64))


def follow(keys, seconds, rng, poses):
    """Write the poses along the keys, smooth in between, with tremor."""
    table = np.array([[time, *pose] for time, _, pose in keys])
    table[:, 1:4] += [POSITIONS.get(near, (0.0, 0.0, 0.0)) for _, near, _ in keys]
    slack = np.array([SLACK[near == "air"] for _, near, _ in keys])
    table[:, 1:4] += rng.uniform(-1, 1, (len(table), 3)) * slack[:, None]
    table = np.vstack([table, [PERIOD, *table[0, 1:]]])
    clock = np.mod(seconds + rng.uniform(-1, 1), PERIOD)
    leg = np.minimum(np.searchsorted(table[:, 0], clock, side="right"), len(table) - 1)
    start, end = table[leg - 1], table[leg]
    p = (clock - start[:, 0]) / (end[:, 0] - start[:, 0])
    blend = (p**3 * (10 - 15 * p + 6 * p * p))[:, None]
    direction = start[:, 1:] + (end[:, 1:] - start[:, 1:]) * blend + tremor(seconds, rng)
    poses[:, :3, 3] = direction[:, :3]
    poses[:, :3, :3] = Rotation.from_rotvec(direction[:, 3:]).as_matrix()


def tremor(seconds, rng):
    """Shaking (T, 6) in metres and radians: four waves of 0.2 to 2.2 Hz an axis."""
    rate, phase = rng.uniform(0.2, 2.2, (6, 4)), rng.uniform(0, 2 * np.pi, (6, 4))
    return np.sin(2 * np.pi * rate * seconds[:, None, None] + phase).mean(axis=2) * np.repeat(TREMOR, 3)


def mesh_of(kind, faces):
    """Vertices and faces of a body of this kind."""
    if kind == "tray":
        steps = max(1, round(np.sqrt(faces / 2))) + 1
        x, y = np.meshgrid(*(np.linspace(-size / 2, size / 2, steps) for size in TRAY_SIZE), indexing="ij")
        points = np.stack([x, y, np.zeros_like(x)], axis=-1)
    elif kind == "ring":  # a wire of 4 mm bent to a ring of 4 cm, 30 cm above its place
        around = max(8, round(np.sqrt(1.5 * faces)))
        across = np.linspace(0, 2 * np.pi, max(4, faces // (2 * around)) + 1)
        circle = np.stack([0.04 + 0.004 * np.cos(across), 0.3 + 0.004 * np.sin(across)], axis=1)
        points = about_z(circle, around).transpose(1, 0, 2)
    elif kind == "hand":  # an egg of 4 by 5.5 cm with bumps for fingers
        angle = np.linspace(0.01, np.pi - 0.01, 60)
        points = revolved(np.stack([0.04 * np.sin(angle), -0.055 * np.cos(angle)], axis=1), faces, 1.2)
        around = np.arctan2(points[..., 1], points[..., 0])
        points[..., :2] *= (1 + 0.1 * np.sin(4 * around + 90 * points[..., 2]))[..., None]
    else:
        points = revolved(np.array(PROFILES[kind]["points"]), faces, PROFILES[kind]["aspect"])
    return grid(points)


def revolved(profile, faces, aspect):
    """Points (along, around, 3) of a profile (m, 2) turned about z; ``aspect`` is sides for each step along it."""
    along = max(4, round(np.sqrt(faces / (2 * aspect))))
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(profile, axis=0).T))])
    at = np.linspace(0, arc[-1], along + 1)
    points = np.stack([np.interp(at, arc, column) for column in profile.T], axis=1)
    return about_z(points, max(6, round(faces / (2 * along))))


def about_z(profile, around):
    """Points (m, around + 1, 3) of (radius, height) rows, once round."""
    radius, height = profile.T
    angle = np.linspace(0, 2 * np.pi, around + 1)
    x, y = (np.outer(radius, circle(angle)) for circle in (np.cos, np.sin))
    return np.stack([x, y, np.tile(height[:, None], (1, around + 1))], axis=-1)


def grid(points):
    """Two triangles a cell of a grid of points (rows, columns, 3)."""
    rows, columns = points.shape[:2]
    number = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    faces = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3).astype(np.int32)
    return points.reshape(-1, 3).astype(np.float32).astype(np.float64), faces


class OwnExact:
    """The detector ``exact`` by default settings: poses checked in every call, trees kept, answers never.

    Containment is decided, which no peer does; it is no contact of surfaces and so not part of the answer.
    """

    def __init__(self, load):
        self.load = load
        bodies = [Body(name, TriangleMesh(*mesh)) for name, mesh in zip(load.names, load.meshes, strict=True)]
        self._detector = create_detector("exact", bodies, pairs=load.pairs)

    def staged(self, what):
        """Seconds of every stage, the check of the poses first, and the ``Detection``."""
        begin = perf_counter()
        motion = Motion.from_matrices(np.arange(len(self.load.poses)) / self.load.rate_hz, self.load.poses)
        checked = perf_counter() - begin
        result = self._detector.detect(motion, faces=what == "faces")
        return {"check": checked} | {name: float(np.sum(spent)) for name, spent in result.seconds.items()}, result

    def ask(self, what):
        """Answers for every pair in every frame (T, P): for "faces" how many pairs of faces meet, for "bool" 0 or 1."""
        result = self.staged(what)[1]
        return result.face_counts if what == "faces" else (result.verdict == Verdict.CONTACT).view(np.int8)


class Candidate:
    """Answers ``(workload, what)`` as `OwnExact` does; trees are kept between calls for the same meshes."""

    engine = None

    def __call__(self, workload, what):
        if self.engine is None or self.engine.load.meshes is not workload.meshes:
            self.engine = OwnExact(workload)
        self.engine.load = workload
        return self.engine.ask(what)


run = Candidate()
"""For ``peers.py --candidate support.bench_loads:run``, with ``tests`` on the path."""


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
            self._move(body, pose)

    def ask(self, what):
        """Every pair in every frame."""
        faces, requested, collide = what == "faces", self._load.pairs.tolist(), self._fcl.collide
        request = self._fcl.CollisionRequest(num_max_contacts=EVERY_CONTACT if faces else 1, enable_contact=False)

        def fill(row):
            for k, (i, j) in enumerate(requested):
                result = FacePairs()
                if collide(self._things[i], self._things[j], request, result):
                    row[k] = len(set(result.faces)) if faces else 1

        return frame_by_frame(self._load, self._move, fill)

    def _move(self, body, pose):
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
        trees, placed, requested = self._trees, self._placed, self._load.pairs.tolist()

        def move(body, pose):
            placed[body] = self._pose(pose)

        def fill(row):
            for k, (i, j) in enumerate(requested):
                result.clear()
                if collide(trees[i], placed[i], trees[j], placed[j], request, result):
                    row[k] = len({(contact.b1, contact.b2) for contact in result.getContacts()})

        return frame_by_frame(self._load, move, fill)

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

        def move(body, pose):
            manager.set_transform(names[body], pose)

        def fill(row):
            if what == "faces":
                contacts = manager.in_collision_internal(return_data=True)[1]
                result = {(*sorted(c.names), *(c.index(name) for name in sorted(c.names))) for c in contacts}
            else:
                result = set(manager.in_collision_internal(return_names=True)[1])
            for a, b, *_ in result:
                if frozenset((a, b)) in column:
                    row[column[frozenset((a, b))]] += 1

        return frame_by_frame(self._load, move, fill)


def frame_by_frame(load, move, fill):
    """The plain loop: in every frame place what moves, then fill the answers of all pairs (P,)."""
    counts = np.zeros((len(load.poses), len(load.pairs)), dtype=np.int64)
    moving = np.flatnonzero((load.poses != load.poses[:1]).any(axis=(0, 2, 3))).tolist()
    for row, poses in zip(counts, load.poses, strict=True):
        for body in moving:
            move(body, poses[body])
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


MINUTES, FACES = 10, 5000


def ten_minutes():
    """The minute of bumps ten times over, two more glasses beside it, everything paired that moves."""
    minute, _ = make_scene_session("bench-bumps", faces=FACES)
    spare = {
        "spare-beaker": Placed("beaker_250", (0.35, 0.9001, 0.15)),
        "spare-flask": Placed("erlenmeyer_flask", (0.02, 0.9001, -0.20)),
    }
    layout = Instruments(spare, FACES)
    tracks = {name: repeated(track) for name, track in minute.tracks.items()}
    stamps = tracks["headset"].times_ns
    for name, item in spare.items():
        poses = (np.tile(row, (len(stamps), 1)) for row in (item.position, item.quaternion))
        tracks[name] = Track(stamps, *poses)
    scene = Scene("ten-minutes", (*minute.scene.bodies, *layout.bodies()))
    return Session.from_tracks(tracks, meshes={**minute.meshes, **layout.meshes}, scene=scene)


def repeated(track):
    """The track MINUTES times, one after the other."""
    times = track.times_ns
    span = times[-1] - times[0] + int(np.median(np.diff(times)))
    poses = (np.concatenate([piece] * MINUTES) for piece in (track.positions, track.quaternions_xyzw, track.valid))
    return Track(np.concatenate([times + k * span for k in range(MINUTES)]), *poses)
