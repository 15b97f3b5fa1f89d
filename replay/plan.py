"""What a scene calls for: its effects, its pairs, the topics they need; nothing else will run."""

from __future__ import annotations

from dataclasses import dataclass

from sessions.scene import Scene


@dataclass(frozen=True)
class Plan:
    """What a run has to do for a scene.

    Parameters
    ----------
    effects : kinds of the declared effects, each once, in the order declared.
    pairs : declared pairs of body names; ``None``: all with relative motion.
    detection : whether contacts are needed at all: not by a scene whose effects table is empty.
    """

    effects: tuple[str, ...]
    pairs: tuple[tuple[str, str], ...] | None
    detection: bool


def plan(scene: Scene) -> Plan:
    """Say what a scene calls for.

    A scene without an effects table is there to be audited, and wants its contacts. A scene that declares an empty one
    asks for nothing to be simulated; its contacts are still detected, because a recording is audited by default.
    """
    kinds = dict.fromkeys(effect.kind for effect in scene.effects or ())
    return Plan(tuple(kinds), scene.pairs, detection=True)
