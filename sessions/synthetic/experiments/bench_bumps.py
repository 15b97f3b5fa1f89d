"""The steps of `bench-bumps`: bumps of thin glasses that are brief, or stay, at moments that only the seed decides.

The right hand stirs in a beaker with a glass rod and then taps things with it; the left raps its knuckles against
glasses, carries a graduated cylinder, clinks it against a flask and sets it down too hard.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from sessions.synthetic.bench import BENCH_TOP, STAND_M
from sessions.synthetic.experiments.lab import AWAY, SNAP, Lab
from sessions.synthetic.experiments.steps import looking_key
from sessions.synthetic.paths import Dent, KeyPath, OnHand, Standing, Stir, minimum_jerk_inverse
from sessions.synthetic.sections import round_in_round
from sessions.synthetic.truth import Interval

GRIP_HEIGHT = 0.19
LIFT = 0.03
PRESSED_IN = 0.0015
ROD_CLEAR_OF_FLOOR = 0.018
CLEARANCE = 0.006
EYES = np.array([0.02, 1.56, 0.56])

# Noise of a tracked hand leaves 0.9 mm open (five sigma) and tessellation up to 0.3 mm: taps go deeper than both.
# Glass that is knocked rebounds within some 20 ms; what is pushed or rested against stays for tenths of a second.
DEPTHS_M = (0.0024, 0.0029)
BRIEF_S = (0.018, 0.025)
LONG_S = (0.18, 0.34)
TAP_FROM_M = 0.024
CYLINDER_IN_HAND = np.array([0.0, SNAP - GRIP_HEIGHT, 0.0])
CYLINDER_GOAL = np.array([-0.43, BENCH_TOP + STAND_M, 0.13])


def hold_rod(lab: Lab) -> None:
    """The right hand holds the rod from first to last."""
    lab.things["rod"] = [(0.0, OnHand("hand-right", -lab.layout.site("rod", "grip")))]


def stir_and_touch(lab: Lab) -> None:
    """Stir in the beaker; eight times the rod touches the wall inside."""
    script, rod = lab.hands["right"], lab.layout.site("rod", "grip")
    height = lab.layout.cavity("beaker").floor_height + ROD_CLEAR_OF_FLOOR
    tip = lab.layout.at("beaker") + np.array([0.0, height, 0.0])
    sure, possible = round_in_round(lab.layout.meshes["rod"], lab.layout.meshes["beaker"], height)
    script.go(tip + rod + (0.0, 0.125, 0.0), 1.9, arc=0.03)
    script.go(tip + rod, 1.1)
    start, radius, revolutions = script.now, 0.012, float(lab.rng.uniform(1.0, 1.25))
    reach, slack = 0.5 * (sure + possible), 0.5 * (sure - possible)
    now, taps = start + 1.1, []
    for brief in (True, False, True, False, False, True, False, True):
        dent = _dent(lab, brief, reach - radius)
        tap = dent.tap(_centre(lab, now, dent))
        taps.append(tap)
        lab.tapped("beaker", "rod", dent, tap, slack, _note(brief, "the rod touches the wall inside"))
        now = tap.start + tap.period + float(lab.rng.uniform(0.9, 1.3))
    end = now + 0.9
    script.overlays.append(Stir(start, end, radius, revolutions, taps=tuple(taps)))
    script.quiet.append((start, end))
    script.wait_until(end)
    _secure(lab, "right", start - 2.0, end + 1.5)
    script.go(tip + rod + (0.0, 0.125, 0.0), 0.9)


HAND_OF = {"rod": "right", "cylinder": "left", "hand-left": "left"}
"""Mover -> the hand that it is, or that holds it."""


def bump(
    lab: Lab,
    mover: str,
    target: str,
    *,
    height: float,
    earliest: float,
    kinds: Sequence[str],
    cross_at: float = 0.0,
    direction: ArrayLike = AWAY,
) -> None:
    """Go before the target, at the height ``cross_at`` or as high as the hand is, tap it once for each of ``kinds``
    (brief or long), step back."""
    side = HAND_OF[mover]
    script, at = lab.hands[side], lab.layout.at(target)
    grip = {"rod": lab.layout.site("rod", "grip"), "cylinder": -CYLINDER_IN_HAND}.get(mover, np.zeros(3))
    meets = lab.approach(mover, target, height, direction)
    dents = [_dent(lab, kind == "brief", TAP_FROM_M) for kind in kinds]
    script.over(meets.origin_at(at, 0.05) + grip, cross_at or script.position[1])
    script.wait_until(earliest - 1.0)
    for kind, dent in zip(kinds, dents, strict=True):
        script.go(meets.origin_at(at, dent.gap) + grip, 0.6)
        script.wait(0.15)
        tap = dent.tap(_centre(lab, script.now, dent), meets.direction)
        script.tap(tap)
        lab.tapped(mover, target, dent, tap, meets.slack, _note(kind == "brief", f"{mover} raps {target}"))
        _secure(lab, side, tap.start, tap.start + tap.period)
        script.wait(float(lab.rng.uniform(0.4, 0.9)))
    script.go(meets.origin_at(at, 0.06) + grip)


def carry_cylinder(lab: Lab) -> None:
    """Take the cylinder, clink it twice against the flask and set it down too hard."""
    script, at = lab.hands["left"], lab.layout.at("cylinder")
    grip, bodies = -CYLINDER_IN_HAND, ("cylinder", "hand-left")
    script.over(at + np.array([0.0, GRIP_HEIGHT, 0.0]), lab.travel)
    script.wait(0.3)
    grasped_from, grasped = script.now, script.now + lab.late
    script.wait(0.3)
    script.go(at + grip + (0.0, LIFT, 0.0), 0.8)
    bump(
        lab,
        "cylinder",
        "flask",
        height=LIFT,
        earliest=script.now + 2.5,
        kinds=("brief", "long"),
        direction=(1.0, 0.0, 0.0),
    )
    script.go(CYLINDER_GOAL + grip + (0.0, LIFT - STAND_M, 0.0), 1.5)
    down, taken = script.now, 1.3
    script.go(CYLINDER_GOAL + grip - (0.0, PRESSED_IN + STAND_M, 0.0), taken)
    script.wait(0.35)
    let_go, released = script.now, script.now + lab.late

    def pressed(level: float) -> list[Interval]:
        """When the base is at most ``level`` above the bench on its way from `LIFT` down to `PRESSED_IN` below."""
        fraction = (LIFT - level) / (LIFT + PRESSED_IN)
        return [(down + taken * minimum_jerk_inverse(max(0.0, fraction)), let_go)] if fraction <= 1.0 else []

    lab.contact("bench", "cylinder", pressed, error_m=lab.noise_m, late=lab.late)
    script.quiet.append((down, let_go + 0.3))
    script.wait(0.4)
    _secure(lab, "left", grasped_from - 1.0, script.now)
    riding = OnHand("hand-left", CYLINDER_IN_HAND)
    lab.things["cylinder"] += [(grasped, riding), (released, Standing(CYLINDER_GOAL))]
    lab.presses["left"].append((grasped, released))
    for kind, time in (("grasp", grasped), ("release", released)):
        lab.fact(kind, time, time, bodies, hand="left")


def nearly_touch(lab: Lab) -> None:
    """Come within 6 mm of the small beaker and stop."""
    script, at, bodies = lab.hands["left"], lab.layout.at("small-beaker"), ("hand-left", "small-beaker")
    meets = lab.approach(*bodies, 0.055)
    script.go(meets.origin_at(at, 0.05))
    script.go(meets.origin_at(at, CLEARANCE))
    arrived = script.now
    script.quiet.append((arrived, arrived + 0.6))
    script.wait(0.6)
    _secure(lab, "left", arrived - 0.5, script.now + 0.3)
    lab.fact("near_miss", arrived + lab.late, script.now + lab.late, bodies, clearance_m=CLEARANCE)


def watch(lab: Lab, at: Sequence[tuple[float, str]]) -> None:
    """The head stands on the person's side of the bench and looks to where the work is."""
    keys = []
    for time, name in at:
        eyes = EYES + lab.rng.uniform(-0.03, 0.03, 3)
        moment = time + float(lab.rng.uniform(0.0, 0.8)) * (time > 0.0)
        keys.append(looking_key(moment, eyes, lab.layout.at(name) + np.array([0.0, 0.08, 0.0])))
    lab.gaze = KeyPath(keys)


def _dent(lab: Lab, brief: bool, gap: float) -> Dent:
    """A tap of random depth and duration from a rest ``gap`` metres short of first contact."""
    depth = float(lab.rng.uniform(*DEPTHS_M))
    return Dent(depth, float(lab.rng.uniform(*(BRIEF_S if brief else LONG_S))), gap + depth)


def _centre(lab: Lab, earliest: float, dent: Dent) -> float:
    """When the tap is deepest: soon after ``earliest``, at a moment that only the seed decides."""
    return earliest + dent.period / 2.0 + float(lab.rng.uniform(0.05, 0.3))


def _secure(lab: Lab, side: str, start: float, end: float) -> None:
    """The hand must not be lost from ``start`` to ``end`` (time of the motion)."""
    lab.keep[f"hand-{side}"].append((start + lab.late - 0.1, end + lab.late + 0.1))


def _note(brief: bool, text: str) -> str:
    return f"{text}, {'briefly' if brief else 'and stays'}"
