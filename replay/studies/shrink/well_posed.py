"""Whether a fault is well posed: every face has an area, and no shift within tolerance gives the other answer.

Engines may differ about needles and about surfaces that only touch, so a test of these proves nothing.
"""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum
from typing import Final

import numpy as np

from cdcore import TriangleMesh
from cdcore.narrow.brute_force import meeting_faces_exhaustive
from cdcore.narrow.ill_posed import MarginStage
from cdcore.numerics import BoolArray
from cdcore.tolerances import TWO_MICROMETRES
from replay.studies.shrink.wrong_answer import WrongAnswer

MARGIN_TEXT: Final = f"{1e6 * TWO_MICROMETRES:g} micrometres"


class Doubt(StrEnum):
    """Why a fault is not well posed; the value is a sentence for people."""

    THIN = f"A face is less than {MARGIN_TEXT} high: engines may differ about faces without an area."
    SHALLOW = f"No two faces overlap by more than {MARGIN_TEXT}; only together they keep the bodies in contact."
    LOOSE = f"A shift by {MARGIN_TEXT} ends the contact: engines may differ about what only touches."
    NEAR = f"The surfaces are less than {MARGIN_TEXT} apart: engines may differ about what almost touches."


def doubts_of(fault: WrongAnswer) -> frozenset[Doubt]:
    """Doubts about the last frame of a fault; none about a contact that only the path between frames shows.

    A body inside another counts as apart: their surfaces must not come near.
    """
    thin = {Doubt.THIN} if any(thin_faces(body.mesh).any() for body in fault.bodies) else set()
    return frozenset(thin | set(_margin(fault)))


def thin_faces(mesh: TriangleMesh) -> BoolArray:
    """(f,) whether a face is at most the tolerance high, over its longest edge."""
    a, b, c = mesh.triangles.transpose(1, 0, 2)
    longest = np.max([np.linalg.norm(edge, axis=1) for edge in (b - a, c - b, a - c)], axis=0)
    return np.asarray(np.linalg.norm(np.cross(b - a, c - a), axis=1) <= TWO_MICROMETRES * longest)


def _margin(fault: WrongAnswer) -> Iterable[Doubt]:
    first, second = fault.pairs[0].tolist()
    rotations, move = fault.motion.rotations[-1, [first, second]], fault.motion.translations[-1, [first, second]]
    stage, pair = MarginStage(fault.bodies, TWO_MICROMETRES), (first, second)
    if fault.contact:
        meeting_faces = meeting_faces_exhaustive(fault.corners(first), fault.corners(second))
        if len(meeting_faces):
            if not stage.shallow(pair, meeting_faces, rotations, move):
                return ()
            return (
                (Doubt.SHALLOW, Doubt.LOOSE) if stage.loose(pair, meeting_faces, rotations, move) else (Doubt.SHALLOW,)
            )
        if fault.oracle == "continuous":
            return ()
    return (Doubt.NEAR,) if stage.near(pair, rotations[None], move[None])[0] else ()
