"""Which row asks an engine itself what another row re-creates, and where the two differ."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from cdcore import Motion, create_detector
from cdcore.bounding.hull import hull_collider
from cdcore.narrow.fcl_meshes import FclMeshes
from cdcore.numerics import BoolArray
from cdcore.protocol import Detector, counts_as_contact, is_undecided
from replay.detection.detector_spec import parse_detector
from replay.prepare.assembly import Assembly

OFFSET: Final = {"rapier": ("prediction_m", 2.0), "bullet": ("margin_m", 1.0), "physx": ("contact_offset_m", 1.0)}
"""Engine -> its setting that stands for ``skin_m`` of ``collider``, and how many times as long it is."""

MOST_GAPS: Final = 400
"""Of the pair-frames in which two rows differ, those whose distance is measured."""


def engine_twin(engine: str, setting: str) -> str | None:
    """The row that asks an engine itself what a row of ``collider`` re-creates; ``None`` where it cannot be asked.

    ``engine`` is ``rapier``, ``bullet`` or ``physx``; ``setting`` as in ``--detectors``. Hulls (one convex piece is a
    hull) and meshes can be asked. PhysX reports no contact without an offset, so triggers of Unity cannot.

    Examples
    --------
    >>> engine_twin("physx", "collider[shape=hull,rate_hz=50,skin_m=0.01]")
    'physx[shape=hull,rate_hz=50.0,contact_offset_m=0.01]'
    """
    spec = parse_detector(setting)
    settings = dict(spec.settings)
    skin = float(settings.pop("skin_m", 0.0))
    shape = settings.pop("shape", "hull")
    if shape == "compound" and settings.get("pieces") == 1:
        shape = "hull"
        settings.pop("pieces")
    rate = settings.pop("rate_hz", None)
    if spec.name != "collider" or shape not in ("hull", "mesh") or settings or (engine == "physx" and not skin):
        return None
    name, times = OFFSET[engine]
    parts = [f"shape={shape}"] + ([] if rate is None else [f"rate_hz={float(rate)}"]) + [f"{name}={times * skin}"]
    return f"{engine}[{','.join(parts)}]"


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
    asked, recreated = _answer(assembly, engine), _answer(assembly, ours)
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


def _answer(assembly: Assembly, setting: str) -> np.ndarray:
    spec = parse_detector(setting)
    detector: Detector = create_detector(spec.name, assembly.bodies, pairs=assembly.pairs, **spec.settings)
    return detector.detect(assembly.motion).verdict


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
