"""Digests of all detectors in many worlds.

``python tests/support/digests.py`` writes ``tests/contracts/digests.json`` anew, for a change that is meant; give names
of groups or detectors to write only these.
"""

import hashlib
import json
import sys
from functools import cache
from itertools import islice
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parents[2]))

from support.optional import DATA
from support.random_worlds import SHAPES, World, random_world
from support.shapes import lab_bodies_and_motion

from cdcore import create_detector
from cdcore.errors import CollisionCoreError
from replay.prepare.assemble import assemble
from replay.studies.stress.scenes import SCENE_CASES as HARD
from sessions.importers import import_session
from sessions.synthetic.scenes import SCENES, make_scene_session

FILE = Path(__file__).parents[1] / "contracts" / "digests.json"
VARIANTS = (
    ("sphere", {}), ("aabb", {}), ("obb", {}), ("obb", {"budget": 100}), ("static", {}), ("discrete", {}),
    ("discrete", {"rate_hz": 50}), ("hybrid", {}), ("qaco", {"budget": 100}), ("hybrid-qaco", {"budget": 100}),
    ("hybrid-qaco", {"decide": "mesh", "budget": 100}), ("collider", {}), ("collider", {"shape": "mesh"}),
    ("collider", {"skin_m": 0.005}), ("rapid-style", {}), ("rapid-style", {"mode": "first"}), ("solid-style", {}),
    ("solid-style", {"mode": "first", "budget": 40}), ("image-space", {"resolution": 8}), ("exact", {}),
    ("continuous", {}),
)  # fmt: skip
"""Detectors and settings."""
SCALE_FREE = ("sphere", "aabb", "obb", "collider", "rapid-style", "solid-style", "exact", "continuous")
"""Detectors that promise an answer on faces without area and at any scale; the others round, or search by area."""
SEARCHES = tuple(
    ("qaco", {"budget": 100, **settings})
    for settings in (
        {"variant": "corrected"}, {"variant": "local"}, {"variant": "random"}, {"variant": "printed"}, {"samples": 40},
        {"stop_first": False}, {"rest": 5.0, "budget": 300}, {"warm_start": False},
    )
)  # fmt: skip
"""Other searches of ``qaco``, asked in the laboratory."""
QUICK_SCENES = ("silver-chloride",)
RECORDINGS = ("grabLeft", "grabRight", "tracked-recording")
QUICK_SEEDS, ALL_SEEDS = range(1), range(40)


def strided(assembly, frames):
    """Frames spread evenly over a recording, in threes that follow each other."""
    first = np.linspace(0, len(assembly.motion) - 3, frames // 3).astype(np.int64)
    motion = assembly.motion.take(np.unique(first[:, None] + np.arange(3)))
    return World(assembly.bodies, motion, assembly.pairs)


def of_scene(name, frames, **settings):
    """Every n-th frame of a made-up scene, so many in all."""
    yield strided(assemble(make_scene_session(name, **settings)[0]), frames)


def of_small_scene(name):
    """Yields 30 frames of a made-up scene, whose bodies have 500 faces."""
    yield from of_scene(name, 30, faces=500)


def of_laboratory():
    """Two dozen frames of five bodies, of which three move through the others and then rest."""
    bodies, motion = lab_bodies_and_motion(frames=80)
    yield World(bodies, motion.frames(30, 54))


def of_recording(name, frames):
    """Frames of a recording of two controllers by a person."""
    wand = DATA / "webxr-vive-controller" / "htc-vive-none.glb"
    file = DATA / "aframe-motion-capture" / f"{name}.json"
    yield strided(assemble(import_session("aframe", file, meshes={"left": wand, "right": wand})), frames)


def of_hard_case(number):
    """The first twelve scenes of a numbered hard case."""
    for scene in islice(HARD[number][1](np.random.default_rng(3)), 12):
        yield World(scene.bodies, scene.motion.frames(0, 12))


def of_random(shape, seeds):
    """Random worlds of a shape."""
    for seed in seeds:
        yield random_world(seed, shape)


QUICK = {f"small scene {name}": (of_small_scene, name) for name in QUICK_SCENES}
QUICK |= {f"random {shape}, {len(QUICK_SEEDS)}": (of_random, shape, QUICK_SEEDS) for shape in SHAPES}
QUICK["laboratory"] = (of_laboratory,)
CHEMISTRY = ("carbonate-titration", "marble", "ammonia-calorimetry")
"""Scenes that came after the digests and are about what is in the glasses."""
SLOW = {f"scene {name}": (of_scene, name, 300) for name in SCENES if name not in CHEMISTRY}
SLOW |= {f"hard case {number}": (of_hard_case, number) for number in HARD}
SLOW |= {f"random {shape}": (of_random, shape, ALL_SEEDS) for shape in SHAPES}
REAL = {f"recording {name}": (of_recording, name, 120) for name in RECORDINGS}
GROUPS = QUICK | SLOW | REAL


def variant_name(name, settings):
    """A detector's name with its settings."""
    return name + "".join(f"[{key}={value}]" for key, value in settings.items())


@cache
def worlds(group):
    """The worlds of a group."""
    maker, *operands = GROUPS[group]
    return tuple(maker(*operands))


def asked_in(group):
    """The detectors that a group is shown to: of random worlds only those that promise an answer in them."""
    if group == "laboratory":
        return [*VARIANTS, *SEARCHES]
    kept = SCALE_FREE if group.startswith("random") else [name for name, _ in VARIANTS]
    return [(name, settings) for name, settings in VARIANTS if name in kept]


def digests(group, name, settings):
    """Digests of verdicts, faces and counters in all worlds of a group, 12 digits each, in one line."""
    totals = [hashlib.sha256() for _ in range(3)]
    for world in worlds(group):
        for total, piece in zip(totals, pieces_of(world, name, settings), strict=True):
            total.update(f"{piece}\n".encode())
    return " ".join(total.hexdigest()[:12] for total in totals)


def pieces_of(world, name, settings):
    """Digest of the verdicts, digest of the faces, and the counters, as texts; a refusal in place of all three."""
    try:
        detection = create_detector(name, world.bodies, pairs=world.pairs, **settings).detect(world.motion, faces=True)
    except CollisionCoreError as error:
        return (type(error).__name__,) * 3
    faces = None if detection.face_sets is None else detection.faces_digest
    work = {key: int(np.sum(count)) for key, count in sorted(detection.work.items()) if np.sum(count)}
    return detection.digest, faces, json.dumps(work)


def write(names):
    """Digests of the named groups and detectors into the file, the others as they are there."""
    known = json.loads(FILE.read_text())
    groups, detectors = [name for name in names if name in GROUPS], [name for name in names if name not in GROUPS]
    for group in groups or GROUPS:
        print(group, flush=True)
        chosen = [item for item in asked_in(group) if item[0] in detectors or not detectors]
        known[group] = known.get(group, {}) | {variant_name(*item): digests(group, *item) for item in chosen}
        worlds.cache_clear()
    kept = {group: known[group] for group in GROUPS if group in known}
    FILE.write_text(json.dumps(kept, indent=0) + "\n")


if __name__ == "__main__":
    write(sys.argv[1:])
