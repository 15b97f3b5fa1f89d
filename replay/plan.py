"""What a scene calls for: its effects, its pairs, the topics they need; nothing else will run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from sessions.scene import Scene

NEED_CONTACT: Final = frozenset({"contact", "penetration", "sweep", "grasp", "placement", "burn-exposure", "breakage"})
"""Effects that cannot do without collision detection; pouring, mixing, heat and their like do."""


@dataclass(frozen=True)
class Plan:
    """What a run has to do for a scene.

    Parameters
    ----------
    effects : kinds of the declared effects, each once, in the order declared.
    pairs : declared pairs of body names; ``None``: all with relative motion.
    detection : whether contacts are needed at all: not by a scene that declares effects and none that needs them.
    """

    effects: tuple[str, ...]
    pairs: tuple[tuple[str, str], ...] | None
    detection: bool


def plan(scene: Scene) -> Plan:
    """Say what a scene calls for.

    A scene without an effects table is there to be audited, and wants its contacts. One that declares its effects gets
    what they need: a titration makes no collision query at all.
    """
    kinds = dict.fromkeys(effect.kind for effect in scene.effects or ())
    return Plan(tuple(kinds), scene.pairs, detection=scene.effects is None or not NEED_CONTACT.isdisjoint(kinds))
