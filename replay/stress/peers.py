"""Engines of others, asked the same questions where they are installed: neither is needed, neither is a detector.

They stand in the table to show what their answers are worth on the same pairs. ``trimesh`` makes a solid of a convex
mesh, and ``coal`` takes what is nearer than some micrometres for touching.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from cdcore import Verdict
from cdcore.numerics import FloatArray
from replay.stress.posing import verdicts_of

Ask = Callable[[FloatArray], NDArray[np.uint8]]


def coal_verdicts(pairs: FloatArray) -> NDArray[np.uint8]:
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


def trimesh_verdicts(pairs: FloatArray) -> NDArray[np.uint8]:
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


def answers_of(name: str, pairs: FloatArray) -> NDArray[np.uint8]:
    """What a peer or a detector of that name says of each triangle pair (n, 2, 3, 3)."""
    return PEERS[name](pairs) if name in PEERS else verdicts_of(name, pairs)


def installed_peers() -> list[str]:
    """The peers that can be asked on this machine."""
    return [name for name in PEERS if find_spec(name) is not None]


def verdict_each(pairs: FloatArray, meets: Callable[[FloatArray], bool]) -> NDArray[np.uint8]:
    """One verdict a pair; an engine that raises has refused."""
    verdict = np.empty(len(pairs), dtype=np.uint8)
    for k, pair in enumerate(pairs):
        try:
            verdict[k] = Verdict.CONTACT if meets(pair) else Verdict.CLEAR
        except Exception:  # an engine of others raises whatever it likes, and that is a result
            verdict[k] = Verdict.INVALID
    return verdict
