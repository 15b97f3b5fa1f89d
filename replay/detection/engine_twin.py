"""A row that asks an engine itself beside a row that re-creates it, and where the two differ."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from cdcore import Motion
from cdcore.bounding.hull import hull_collider
from cdcore.narrow.fcl_meshes import FclMeshes
from cdcore.numerics import BoolArray
from cdcore.protocol import counts_as_contact, is_undecided
from replay.detection.detector_spec import parse_detector
from replay.detection.run_detector import make_detector
from replay.prepare.assembly import Assembly

MOST_GAPS: Final = 400
"""Of the pair-frames in which two rows differ, those whose distance is measured."""


@dataclass(frozen=True)
class TwinCounts:
    """How two rows answer the same pair-frames.

    ``equal``, ``engine_only`` (contact for the engine alone), ``ours_only``: pair-frames that both decide; ``both``:
    those of ``equal`` in which both say contact. ``not_supported``: pair-frames that the engine cannot test.
    ``gaps_mm``: shortest and longest distance between the hulls where the rows differ, ``None`` where they never do.
    """

    equal: int
    both: int
    engine_only: int
    ours_only: int
    not_supported: int
    gaps_mm: tuple[float, float] | None


def compare_twins(assembly: Assembly, engine: str, ours: str) -> TwinCounts:
    """Ask two rows, each as in ``--detectors``, about every pair-frame of a session, and count where they differ."""
    asked, recreated = (
        make_detector(parse_detector(row), assembly, 0).detect(assembly.motion).verdict for row in (engine, ours)
    )
    posed = assembly.motion.valid[:, assembly.pairs].all(axis=2)
    decided = posed & ~is_undecided(asked) & ~is_undecided(recreated)
    theirs, own = counts_as_contact(asked), counts_as_contact(recreated)
    differ = decided & (theirs != own)
    return TwinCounts(
        equal=int((decided & ~differ).sum()),
        both=int((decided & theirs & own).sum()),
        engine_only=int((differ & theirs).sum()),
        ours_only=int((differ & own).sum()),
        not_supported=int((posed & is_undecided(asked)).sum()),
        gaps_mm=_gaps(assembly, differ),
    )


def _gaps(assembly: Assembly, differ: BoolArray) -> tuple[float, float] | None:
    places = np.argwhere(differ)
    if not len(places):
        return None
    hulls = FclMeshes([hull_collider(body.mesh) for body in assembly.bodies])
    motion: Motion = assembly.motion
    gaps = []
    for frame, pair in places[:: -(-len(places) // MOST_GAPS)].tolist():
        a, b = assembly.pairs[pair].tolist()
        for body in (a, b):
            hulls.place(body, motion.rotations[frame, body], motion.translations[frame, body])
        gaps.append(max(0.0, hulls.gap(a, b)[0]) * 1000)
    return min(gaps), max(gaps)
