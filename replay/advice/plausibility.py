"""The alternative of an import's guess that is clearly more like a real scene, if one is."""

from collections.abc import Mapping

from replay.advice.scene_outcome import DEEP_M, VERY_DEEP_M, Outcome


def more_plausible(outcomes: Mapping[str, Outcome]) -> str:
    """Returns the value whose outcome is clearly more like a real scene, or ``""``.

    Bodies that touch and are not deep in each other speak for it; that nothing touches, or bodies deep in each other,
    against it. Of two that are alike in this, contact of bodies that move as one speaks for it, then bodies that touch
    where they rest, then bodies that touch at all. Two that are alike in all of these are as plausible.
    """
    ranked = sorted(outcomes, key=lambda value: _implausibility(outcomes[value]))
    first, second = (_implausibility(outcomes[value]) for value in ranked[:2])
    return ranked[0] if first < second else ""


def _implausibility(outcome: Outcome) -> tuple[int, float, int, int]:
    level = 0
    if outcome.deepest > VERY_DEEP_M:
        level = 2
    elif outcome.deepest > DEEP_M or not outcome.contacts:
        level = 1
    # By tenths: of two that differ by a few frames none is more like a real scene.
    return level, -round(outcome.carried_contact, 1), -outcome.supported, -outcome.touched
