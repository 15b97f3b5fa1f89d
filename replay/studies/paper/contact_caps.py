"""T1c: an engine that stops after k contacts lists k face pairs, whatever meets; its list is no count of faces.

A traversal goes its way whatever its budget, so one that stops at its k-th contact is the traversal with the least
budget that finds k.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cdcore import Motion
from cdcore.narrow.fcl_meshes import FclMeshes
from replay.studies.paper.contestants import Answer, Group, answer_of
from replay.studies.paper.engines import TREES, Engine

CAPS: Final = (1, 10, 100)
"""Contacts after which an engine stops; 1 is the first-contact mode of RAPID and SOLID, and FCL's default."""
FCL: Final = "python-fcl"
CAPPED: Final = (*TREES, FCL)

Capped = Mapping[tuple[str, int], list[tuple[int, Answer]]]
"""Row and cap -> target and answer, a pose each."""


def ask_capped(group: Group, engines: Mapping[str, Engine], whole: Mapping[str, list[int]]) -> Capped:
    """What each row of ``CAPPED`` finds in every pose of a group before it stops.

    ``engines``: of the trees.
    ``whole``: row -> operations of each pose when nothing stops it.
    """
    found: dict[tuple[str, int], list[tuple[int, Answer]]] = {(name, cap): [] for name in CAPPED for cap in CAPS}
    meshes = FclMeshes([body.mesh for body in group.bodies])
    for pose, truth in enumerate(group.truth):
        frame = group.motion.frames(pose, pose + 1)
        for body in range(2):
            meshes.place(body, frame.rotations[0, body], frame.translations[0, body])
        for cap in CAPS:
            for name in TREES:
                pairs, operations = first_contacts(engines[name], frame, cap, whole[name][pose])
                found[name, cap].append((group.target, answer_of(pairs, truth, operations)))
            found[FCL, cap].append((group.target, answer_of(meshes.faces(0, 1, most=cap), truth, 0)))
    return found


def first_contacts(engine: Engine, frame: Motion, cap: int, whole: int) -> tuple[NDArray[np.int64], int]:
    """The first ``cap`` face pairs that a traversal comes to, and its operations until then.

    ``whole``: operations that find every pair.
    """
    least = bisect_left(range(1, whole), cap, key=lambda budget: len(engine.ask(frame, budget)[0]))
    return engine.ask(frame, 1 + least)
