"""Triangle pairs through a detector.

It is asked through the same door as in a run, with its volumes, trees and leaves: each triangle is a body of one face,
and all pairs of a batch stand in one frame.
"""

from dataclasses import fields
from typing import Any, Final

import numpy as np

from cdcore import Body, Motion, TriangleMesh, Verdict, create_detector
from cdcore.detectors.detector_table import load_detector
from cdcore.errors import CHOICE_ERRORS, CollisionCoreError
from cdcore.numerics import ByteArray, FloatArray
from replay.detection.detector_spec import SpecLike, parse_detector

PAIRS_PER_CALL: Final = 500
"""Pairs in one call: two bodies each, so that a detector's tables of bodies stay small."""

SINGLE_FACE: Final = ((0, 1, 2),)

CHEAPER_SETTINGS: Final[dict[str, Any]] = {"containment": False, "sphere": "paper"}
"""Settings, where a detector on meshes has them, that change no verdict here: a single triangle is open, so nothing is
inside it, and any bounding sphere will do. Spheres fitted to each triangle took 94 % of the time."""


def verdicts_of(detector: SpecLike, pairs: FloatArray) -> ByteArray:
    """Verdicts of a detector about triangle pairs.

    ``pairs``: (n, 2, 3, 3). The settings of the detector come before those of ``CHEAPER_SETTINGS``.
    Returns (n,) uint8, values of ``Verdict``; INVALID where it refused the pair with an error of its own.
    Raises ``CHOICE_ERRORS``: the detector cannot be made, whatever the pairs.
    """
    spec = parse_detector(detector)
    known_settings = {item.name for item in fields(load_detector(spec.name).Settings)}
    settings = dict(spec.settings)
    # ``sphere`` keeps its own, because the sphere is its answer.
    if spec.name != "sphere":
        settings = {name: value for name, value in CHEAPER_SETTINGS.items() if name in known_settings} | settings
    verdicts = [
        _batch_verdicts(spec.name, pairs[start : start + PAIRS_PER_CALL], settings)
        for start in range(0, len(pairs), PAIRS_PER_CALL)
    ]
    return np.concatenate([np.zeros(0, dtype=np.uint8), *verdicts])


def _batch_verdicts(detector: str, pairs: FloatArray, settings: dict[str, Any]) -> ByteArray:
    """Ask about all pairs at once; where that is refused, halve until the refused ones stand alone."""
    count = 2 * len(pairs)
    bodies = [Body(f"{k:05d}", TriangleMesh(corners, SINGLE_FACE)) for k, corners in enumerate(pairs.reshape(-1, 3, 3))]
    motion = Motion([0.0], np.zeros((1, count, 3)), np.tile(np.eye(3), (1, count, 1, 1)))
    try:
        engine = create_detector(detector, bodies, pairs=np.arange(count).reshape(-1, 2), **settings)
        return engine.detect(motion).verdict[0]
    except CHOICE_ERRORS:
        raise
    except CollisionCoreError:
        if len(pairs) == 1:
            return np.array([Verdict.INVALID], dtype=np.uint8)
        half = len(pairs) // 2
        return np.concatenate(
            [_batch_verdicts(detector, half_batch, settings) for half_batch in (pairs[:half], pairs[half:])]
        )
