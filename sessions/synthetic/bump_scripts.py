"""What the two hands and the eyes of `bench-bumps` do, and the episodes that this plants."""

import numpy as np

from sessions.geometry.rotations import quaternion_facing
from sessions.synthetic.assembly import Recording
from sessions.synthetic.bench import BENCH_TOP, STAND_M, Instruments
from sessions.synthetic.choreography import Script
from sessions.synthetic.paths import Key, KeyPath, Stir, Tap, minimum_jerk_inverse, point, quaternion_of
from sessions.synthetic.planting import Dent, Planting
from sessions.synthetic.sections import Approach, round_in_round
from sessions.synthetic.truth import Interval

RIGHTWARDS = (1.0, 0.0, 0.0)
ABOVE_ALL = 1.27
GRIP_HEIGHT = 0.19
# A grasped thing snaps to the hand's grip point, this far above where it stood: more than tremor and noise together.
SNAP = 0.002
LIFT = 0.03
PRESSED_IN = 0.0015
ROD_CLEAR_OF_FLOOR = 0.018
LONGEST_LEVER = 0.3

# Noise of a tracked hand leaves 0.9 mm open (five sigma) and tessellation up to 0.3 mm: taps go deeper than both.
# Glass that is knocked rebounds within some 20 ms; what is pushed or rested against stays for tenths of a second.
DEPTHS_M = (0.0024, 0.0029)
BRIEF_S = (0.018, 0.025)
LONG_S = (0.18, 0.34)
TAP_FROM_M = 0.024


class BumpPlan(Planting):
    """What both scripts share: the bench, the clock, and everything planted so far."""

    def __init__(self, layout: Instruments, how: Recording, rng: np.random.Generator) -> None:
        super().__init__(layout, how, LONGEST_LEVER)
        self.rng = rng
        self.rod_in_hand = -layout.site("rod", "grip")
        self.cylinder_in_hand = np.array([0.0, SNAP - GRIP_HEIGHT, 0.0])
        self.cylinder_goal = np.array([-0.43, BENCH_TOP + STAND_M, 0.13])
        self.grasped = self.released = 0.0

    def dent(self, brief: bool, apart: float) -> Dent:
        """A tap of random depth and duration from a rest ``apart`` metres short of first contact."""
        depth = float(self.rng.uniform(*DEPTHS_M))
        seconds = float(self.rng.uniform(*(BRIEF_S if brief else LONG_S)))
        return Dent(depth, seconds, apart + depth)

    def centre(self, earliest: float, dent: Dent) -> float:
        """When the tap is deepest: soon after ``earliest``, at a moment that only the seed decides."""
        return earliest + dent.period / 2.0 + float(self.rng.uniform(0.05, 0.3))

    def plant(self, hand: str, a: str, b: str, dent: Dent, tap: Tap, slack: float, note: str) -> None:
        """Write down the episode of a tap and keep the hand from being lost then."""
        self.tapped(a, b, dent, tap, slack, note)
        self.secure(hand, tap.start, tap.start + tap.period)

    def secure(self, hand: str, start: float, end: float) -> None:
        """The hand must not be lost from ``start`` to ``end`` (time of the motion)."""
        self.keep[hand].append((start + self.late - 0.1, end + self.late + 0.1))


def right_hand(plan: BumpPlan) -> Script:
    """Stir in the beaker, tap the bottle and the small beaker with the rod."""
    script = Script((0.24, 1.13, 0.25))
    rod = -plan.rod_in_hand
    script.wait(1.2)
    _stir(plan, script, rod)
    bottle = plan.approach("rod", "bottle", 0.035, RIGHTWARDS)
    _taps(plan, script, "rod", "bottle", bottle, (True, False), 31.0, rod)
    script.over((0.16, 1.16, 0.24), ABOVE_ALL)
    script.wait_until(48.0)
    small = plan.approach("rod", "small-beaker", 0.025)
    _taps(plan, script, "rod", "small-beaker", small, (True,), 50.5, rod)
    script.over((0.22, 1.13, 0.25), ABOVE_ALL - 0.1)
    return script


def _stir(plan: BumpPlan, script: Script, rod: np.ndarray) -> None:
    height = plan.layout.cavity("beaker").floor_height + ROD_CLEAR_OF_FLOOR
    tip = plan.layout.at("beaker") + np.array([0.0, height, 0.0])
    sure, possible = round_in_round(plan.layout.mesh("rod"), plan.layout.mesh("beaker"), height)
    script.go(tip + rod + (0.0, 0.125, 0.0), 1.9, arc=0.03)
    script.go(tip + rod, 1.1)
    start, radius, turns = script.now, 0.012, float(plan.rng.uniform(1.0, 1.25))
    reach, slack = 0.5 * (sure + possible), 0.5 * (sure - possible)
    now, taps = start + 1.1, []
    for brief in (True, False, True, False, False, True, False, True):
        dent = plan.dent(brief, reach - radius)
        tap = dent.tap(plan.centre(now, dent))
        taps.append(tap)
        plan.plant("hand-right", "beaker", "rod", dent, tap, slack, _note(brief, "the rod touches the wall inside"))
        now = tap.start + tap.period + float(plan.rng.uniform(0.9, 1.3))
    end = now + 0.9
    script.overlays.append(Stir(start, end, radius, turns, taps=tuple(taps)))
    script.quiet.append((start, end))
    script.wait_until(end)
    plan.secure("hand-right", start - 2.0, end + 1.5)
    script.go(tip + rod + (0.0, 0.125, 0.0), 0.9)
    script.go((0.20, 1.2, 0.12))


def _taps(
    plan: BumpPlan,
    script: Script,
    mover: str,
    target: str,
    meets: Approach,
    kinds: tuple[bool, ...],
    earliest: float,
    grip: np.ndarray,
) -> None:
    """Go before the target, tap it once for each of ``kinds`` (True: brief), step back.

    ``grip`` is where the hand's origin lies from the mover's.
    """
    hand = "hand-left" if mover in ("hand-left", "cylinder") else "hand-right"
    at = plan.layout.at(target)
    dents = [plan.dent(brief, TAP_FROM_M) for brief in kinds]
    script.over(meets.place(at, 0.05) + grip, script.position[1] if mover != "rod" else ABOVE_ALL - 0.08)
    script.wait_until(earliest - 1.0)
    for brief, dent in zip(kinds, dents, strict=True):
        script.go(meets.place(at, dent.apart) + grip, 0.6)
        script.wait(0.15)
        centre = plan.centre(script.now, dent)
        tap = script.tap(centre, dent.period, meets.direction, dent.amplitude)
        plan.plant(hand, mover, target, dent, tap, meets.slack, _note(brief, f"{mover} raps {target}"))
        script.wait(float(plan.rng.uniform(0.4, 0.9)))
    script.go(meets.place(at, 0.06) + grip)


def left_hand(plan: BumpPlan) -> Script:
    """Rap knuckles on the small beaker and the flask, then carry, clink and set down the cylinder."""
    script = Script((-0.20, 1.10, 0.29))
    script.wait(2.2)
    nothing = np.zeros(3)
    for target, height, earliest in (("small-beaker", 0.055, 5.0), ("flask", 0.06, 13.0)):
        meets = plan.approach("hand-left", target, height)
        _taps(plan, script, "hand-left", target, meets, (True, False), earliest, nothing)
        script.go((-0.26, 1.12, 0.27))
        script.wait(0.5)
    _carry(plan, script)
    _near_miss(plan, script)
    script.go((-0.24, 1.09, 0.30))
    return script


def _carry(plan: BumpPlan, script: Script) -> None:
    grip = -plan.cylinder_in_hand
    at = plan.layout.at("cylinder")
    script.wait_until(20.5)
    script.over(at + np.array([0.0, GRIP_HEIGHT, 0.0]), ABOVE_ALL)
    script.wait(0.3)
    plan.grasped = script.now + plan.late
    held_from = script.now
    script.wait(0.3)
    script.go(at + grip + (0.0, LIFT, 0.0), 0.8)
    meets = plan.approach("cylinder", "flask", LIFT, RIGHTWARDS)
    _taps(plan, script, "cylinder", "flask", meets, (True, False), script.now + 2.5, grip)
    script.go(plan.cylinder_goal + grip + (0.0, LIFT - STAND_M, 0.0), 1.5)
    down, taken = script.now, 1.3
    script.go(plan.cylinder_goal + grip - (0.0, PRESSED_IN + STAND_M, 0.0), taken)
    script.wait(0.35)
    plan.released = script.now + plan.late
    let_go = script.now
    plan.contact(
        "bench", "cylinder", lambda level: _set_down(level, down, taken, let_go), blur=plan.noise_m, late=plan.late
    )
    script.quiet.append((down, let_go + 0.3))
    script.wait(0.4)
    plan.secure("hand-left", held_from - 1.0, script.now)
    script.over((-0.26, 1.12, 0.28), ABOVE_ALL)
    plan.buttons.hold("left", plan.grasped, plan.released)
    for kind, time in (("grasp", plan.grasped), ("release", plan.released)):
        plan.fact(kind, time, time, ("cylinder", "hand-left"), hand="left")


def _set_down(level: float, start: float, taken: float, end: float) -> list[Interval]:
    """When the base is at most ``level`` above the bench on its way from `LIFT` down to `PRESSED_IN` below."""
    share = (LIFT - level) / (LIFT + PRESSED_IN)
    return [(start + taken * minimum_jerk_inverse(max(0.0, share)), end)] if share <= 1.0 else []


def _near_miss(plan: BumpPlan, script: Script) -> None:
    """Come within 6 mm of the small beaker and stop."""
    meets = plan.approach("hand-left", "small-beaker", 0.055)
    clearance = 0.006
    script.wait_until(43.0)
    script.go(meets.place(plan.layout.at("small-beaker"), 0.05))
    script.go(meets.place(plan.layout.at("small-beaker"), clearance))
    arrived = script.now
    script.quiet.append((arrived, arrived + 0.6))
    script.wait(0.6)
    plan.secure("hand-left", arrived - 0.5, script.now + 0.3)
    bodies = ("hand-left", "small-beaker")
    plan.fact("near_miss", arrived + plan.late, script.now + plan.late, bodies, clearance_m=clearance)
    script.go((-0.26, 1.12, 0.28))


def watching(plan: BumpPlan) -> KeyPath:
    """The head stands on the person's side of the bench and looks to where the work is."""
    rng = plan.rng
    looks_at = [(0.0, "beaker"), (4.0, "beaker"), (9.0, "small-beaker"), (12.0, "beaker"), (17.0, "flask"),
                (21.0, "cylinder"), (27.0, "flask"), (33.0, "bottle"), (38.0, "cylinder"), (44.0, "small-beaker"),
                (50.0, "small-beaker"), (56.0, "beaker")]  # fmt: skip
    keys = []
    for time, name in looks_at:
        eyes = np.array([0.02, 1.56, 0.56]) + rng.uniform(-0.03, 0.03, 3)
        facing = quaternion_facing(plan.layout.at(name) + np.array([0.0, 0.08, 0.0]) - eyes)
        keys.append(Key(time + float(rng.uniform(0.0, 0.8)) * (time > 0.0), point(eyes), quaternion_of(facing)))
    return KeyPath(keys)


def _note(brief: bool, words: str) -> str:
    return f"{words}, {'briefly' if brief else 'and stays'}"
