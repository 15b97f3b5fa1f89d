"""From which distance of two surfaces a detector already reports contact: its contact offset."""

from collections.abc import Callable
from typing import Any, Final

import numpy as np

from cdcore.protocol import Body

UNITY_OFFSET_M: Final = 0.00545
"""Metres: the contact offset that PhysX computes where none is given."""

BULLET_BREAKING: Final = 0.02
"""Bullet keeps contacts up to this share of the smaller body's half diagonal, its contact breaking threshold."""


def contact_reach(detector: Any, pair: int) -> float:
    """Metres between two surfaces from which a detector reports contact of a pair; 0 where it has no such setting."""
    rule = REACHES.get(getattr(detector, "name", ""))
    return 0.0 if rule is None else rule(detector, pair)


def offset_setting(name: str) -> str:
    """The setting of a detector's contact offset; ``""``: it has none."""
    return OFFSET_SETTINGS.get(name, "")


def _bullet(detector: Any, pair: int) -> float:
    margin = detector.settings.margin_m
    ends = detector.pairs[pair].tolist()
    smaller = min(_half_diagonal(detector.bodies[body], margin) for body in ends)
    return float(2.0 * margin + BULLET_BREAKING * smaller)


def _half_diagonal(body: Body, margin: float) -> float:
    """Half the diagonal of a body's box, which is larger by the margin on every side."""
    low, high = body.mesh.bounds
    return float(np.linalg.norm((high - low) / 2.0 + margin))


def _physx(detector: Any, _pair: int) -> float:
    offset = detector.settings.contact_offset_m
    return 2.0 * (UNITY_OFFSET_M if offset is None else float(offset))


OFFSET_SETTINGS: Final = {
    "collider": "skin_m",
    "mujoco": "margin_m",
    "rapier": "prediction_m",
    "bullet": "margin_m",
    "physx": "contact_offset_m",
}
"""Detector -> its setting of a contact offset."""

REACHES: Final[dict[str, Callable[[Any, int], float]]] = {
    "collider": lambda detector, _: 2.0 * float(detector.settings.skin_m),
    "mujoco": lambda detector, _: float(detector.settings.margin_m),
    "rapier": lambda detector, _: float(detector.settings.prediction_m),
    "bullet": _bullet,
    "physx": _physx,
}
"""Detector -> how far its contact offset reaches between the surfaces of a pair."""
