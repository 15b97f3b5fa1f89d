"""Triangle pairs through a detector, or through the engine of others.

A detector is asked through the same door as in a run, with its volumes, trees and leaves: each triangle is a body of
one face, and all pairs of a batch stand in one frame. The engines of others need not be installed; they stand in the
table to show what their answers are worth on the same pairs. ``trimesh`` makes a solid of a convex mesh, and ``coal``
takes what is nearer than some micrometres for touching.
"""

from collections.abc import Callable, Mapping
from dataclasses import fields
from importlib import import_module
from importlib.util import find_spec
from typing import Any, Final

import numpy as np

from cdcore import Body, Motion, TriangleMesh, Verdict, create_detector
from cdcore.detectors import load_detector
from cdcore.errors import CollisionCoreError
from cdcore.numerics import ByteArray, FloatArray

BATCH: Final = 500
"""Pairs in one call: two bodies each, so that a detector's tables of bodies stay small."""

ONE_FACE: Final = ((0, 1, 2),)

CHEAPER: Final[dict[str, Any]] = {"containment": False, "sphere": "paper"}
"""Settings, where a detector on meshes has them, that change no verdict here: a single triangle is open, so nothing is
inside it, and any bounding sphere will do. Spheres fitted to each triangle took 94 % of the time."""

Ask = Callable[[FloatArray], ByteArray]


def coal_verdicts(pairs: FloatArray) -> ByteArray:
    """What ``coal`` says of each triangle pair (n, 2, 3, 3): a tree of one face against another."""
    coal: Any = import_module("coal")
    here, request, result = coal.Transform3s(), coal.CollisionRequest(), coal.CollisionResult()

    def meets(pair: FloatArray) -> bool:
        trees = []
        for corners in pair:
            tree = coal.BVHModelOBBRSS()
            tree.beginModel(1, 3)
            tree.addTriangle(*corners)
            tree.endModel()
            trees.append(tree)
        result.clear()
        return bool(coal.collide(trees[0], here, trees[1], here, request, result))

    return verdict_each(pairs, meets)


def trimesh_verdicts(pairs: FloatArray) -> ByteArray:
    """What the collision manager of ``trimesh`` says of each triangle pair (n, 2, 3, 3)."""
    mesh_of: Any = import_module("trimesh").Trimesh
    manager_of: Any = import_module("trimesh.collision").CollisionManager

    def meets(pair: FloatArray) -> bool:
        managers = []
        for corners in pair:
            manager = manager_of()
            manager.add_object("it", mesh_of(corners, [[0, 1, 2]], process=False))
            managers.append(manager)
        return bool(managers[0].in_collision_other(managers[1]))

    return verdict_each(pairs, meets)


PEERS: Final[dict[str, Ask]] = {"coal": coal_verdicts, "trimesh": trimesh_verdicts}
"""Name of the package -> what asks it."""


def answers_of(name: str, pairs: FloatArray) -> ByteArray:
    """What a peer or a detector of that name says of each triangle pair (n, 2, 3, 3)."""
    return PEERS[name](pairs) if name in PEERS else verdicts_of(name, pairs)


def installed_peers() -> list[str]:
    """The peers that can be asked on this machine."""
    return [name for name in PEERS if find_spec(name) is not None]


def verdict_each(pairs: FloatArray, meets: Callable[[FloatArray], bool]) -> ByteArray:
    """One verdict a pair; an engine that raises has refused."""
    verdict = np.empty(len(pairs), dtype=np.uint8)
    for k, pair in enumerate(pairs):
        try:
            verdict[k] = Verdict.CONTACT if meets(pair) else Verdict.CLEAR
        except Exception:  # an engine of others raises whatever it likes, and that is a result
            verdict[k] = Verdict.INVALID
    return verdict


def verdicts_of(detector: str, pairs: FloatArray) -> ByteArray:
    """What a detector says of each triangle pair.

    ``pairs``: (n, 2, 3, 3).
    Returns (n,) uint8, values of ``Verdict``; INVALID where it refused the pair with an error of its own.
    Raises UnknownDetectorError: lists the names there are.
    """
    # ``sphere`` keeps its own, because the sphere is its answer.
    settings = {} if detector == "sphere" else known_settings(detector, CHEAPER)
    parts = [_batch(detector, pairs[start : start + BATCH], settings) for start in range(0, len(pairs), BATCH)]
    return np.concatenate([np.zeros(0, dtype=np.uint8), *parts])


def known_settings(detector: str, settings: Mapping[str, Any]) -> dict[str, Any]:
    """Those of the settings that this detector has."""
    known = {item.name for item in fields(load_detector(detector).Settings)}
    return {name: value for name, value in settings.items() if name in known}


def _batch(detector: str, pairs: FloatArray, settings: dict[str, Any]) -> ByteArray:
    """Ask about all pairs at once; where that is refused, halve until the refused ones stand alone."""
    try:
        return _ask(detector, pairs, settings)
    except CollisionCoreError:
        if len(pairs) == 1:
            return np.array([Verdict.INVALID], dtype=np.uint8)
        half = len(pairs) // 2
        return np.concatenate([_batch(detector, part, settings) for part in (pairs[:half], pairs[half:])])


def _ask(detector: str, pairs: FloatArray, settings: dict[str, Any]) -> ByteArray:
    count = 2 * len(pairs)
    bodies = [Body(f"{k:05d}", TriangleMesh(corners, ONE_FACE)) for k, corners in enumerate(pairs.reshape(-1, 3, 3))]
    ends = np.arange(count).reshape(-1, 2)
    motion = Motion([0.0], np.zeros((1, count, 3)), np.tile(np.eye(3), (1, count, 1, 1)))
    return create_detector(detector, bodies, pairs=ends, **settings).detect(motion).verdict[0]
