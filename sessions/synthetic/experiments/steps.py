"""Steps of a procedure that have a truth: pour, stir, swirl, rap, come close."""

from collections.abc import Sequence

import numpy as np

from sessions.geometry.rotations import Array, quaternion_about, quaternion_product, rotated
from sessions.synthetic.experiments.lab import UP, Lab
from sessions.synthetic.experiments.pouring import tilt_keeping
from sessions.synthetic.paths import Stir, Tap, minimum_jerk, minimum_jerk_inverse
from sessions.synthetic.planting import AWAY, Dent
from sessions.synthetic.sections import round_in_round

STEP_S = 0.02
# Farther than the rim and the spout of any vessel poured from, so that it clears the target while still upright.
CLEAR_OF_RIM = 0.02
POUR_FROM = 0.03
HOLD_S = 0.6


def pour(lab: Lab, side: str, target: str, millilitres: float, *, seconds: float = 4.0, beside: float = 0.0) -> None:
    """Tilt the held vessel about its lip until ``millilitres`` have left it, then right it again.

    ``beside`` is how far, in metres, the lip is from the middle of the target's opening: farther than its radius the
    liquid is spilled.

    Truth: quasi-statically the vessel keeps what its tilt allows, so the liquid runs from the tilt that keeps all of
    it (``start``) to the greatest tilt (``end``).
    """
    source, script = lab.held[side], lab.hands[side]
    cavity, into = lab.layout.cavity(source), lab.layout.cavity(target).opening
    before = lab.volumes[source]
    onset, greatest = (tilt_keeping(cavity, kept) for kept in (before, before - millilitres))
    turn = lab.where[source][1]
    forward = rotated(turn, (1.0, 0.0, 0.0))
    axis, lip = np.cross(UP, forward), np.array(cavity.opening.lip)
    middle = _mouth(lab, target) + beside * forward
    high = lip[1] + CLEAR_OF_RIM
    lab.carry(side, middle + high * UP - rotated(turn, lip), high=lab.travel - 0.1)
    script.wait(0.3)
    share = np.linspace(0.0, 1.0, round(seconds / STEP_S) + 1)[1:]

    def tilt(eased: Array, times: Array) -> None:
        """Tilt by a share of the way; the lip sinks by the same share from ``high`` to `POUR_FROM` over the target."""
        turns = quaternion_product(quaternion_about(axis, greatest * eased), turn)
        lips = middle + (high + (POUR_FROM - high) * eased)[:, None] * UP
        lab.follow(side, times, lips - rotated(turns, lip), turns)

    start = script.now
    tilt(minimum_jerk(share), start + share * seconds)
    script.wait(HOLD_S)
    tilt(1.0 - minimum_jerk(share), script.now + share * (0.6 * seconds))
    begins = start + seconds * minimum_jerk_inverse(onset / greatest) + lab.late
    missed = abs(beside) > float(into.radius)
    lab.volumes[source] -= millilitres
    lab.volumes[target] += 0.0 if missed else millilitres
    lab.fact(
        "spill" if missed else "pour", begins, start + seconds + lab.late, (source,) if missed else (source, target),
        volume_ml=millilitres, source=source, target="" if missed else target, left_ml=lab.volumes[source],
        onset_tilt_deg=float(np.degrees(onset)), greatest_tilt_deg=float(np.degrees(greatest)),
    )  # fmt: skip


def _mouth(lab: Lab, vessel: str) -> Array:
    """Middle of a standing vessel's opening."""
    position, quaternion = lab.where[vessel]
    return np.array(position) + rotated(quaternion, lab.layout.cavity(vessel).opening.centre)


def stir(
    lab: Lab, side: str, vessel: str, seconds: float, *, radius: float = 0.012, touches: Sequence[float] = ()
) -> None:
    """Stir in a vessel with the held rod, ``touches`` times (lasting so many seconds each) against its wall."""
    rod, script = lab.held[side], lab.hands[side]
    tip_height = lab.layout.cavity(vessel).floor_height + 0.018
    place = np.array(lab.where[vessel][0]) + tip_height * UP
    top = float(_mouth(lab, vessel)[1]) + 0.04
    above = np.array([place[0], top, place[2]])
    lab.carry(side, above, high=max(top, lab.travel - 0.15))
    lab.carry(side, place)
    start, turns = script.now, float(lab.rng.uniform(1.0, 1.3))
    taps = []
    if touches:
        sure, possible = round_in_round(lab.layout.mesh(rod), lab.layout.mesh(vessel), tip_height)
        apart, slack = 0.5 * (sure + possible) - radius, 0.5 * (sure - possible)
        for number, length in enumerate(touches):
            dent = Dent(0.0026, length, apart + 0.0026)
            tap = dent.tap(start + 1.2 + (seconds - 2.4) * (number + 0.5) / len(touches))
            taps.append(tap)
            _plant(lab, vessel, rod, dent, tap, slack, "the rod touches the wall")
    script.quiet.append((start, start + seconds))
    _circle(lab, side, "stir", Stir(start, start + seconds, radius, turns, taps=tuple(taps)), (rod, vessel))
    lab.carry(side, above)


def swirl(lab: Lab, side: str, seconds: float, *, radius: float = 0.006) -> None:
    """Swirl the held vessel in small circles."""
    start, turns = lab.hands[side].now, float(lab.rng.uniform(1.2, 1.6))
    _circle(lab, side, "swirl", Stir(start, start + seconds, radius, turns), (lab.held[side],))


def _circle(lab: Lab, side: str, kind: str, circles: Stir, bodies: tuple[str, ...]) -> None:
    script = lab.hands[side]
    script.overlays.append(circles)
    script.wait_until(circles.end)
    values = {"turns_per_second": circles.turns_per_second, "radius_m": circles.radius}
    lab.fact(kind, circles.start + lab.late, script.now + lab.late, bodies, **values)


def rap(lab: Lab, side: str, target: str, height: float, seconds: float, *, note: str) -> None:
    """Touch a standing glass with the knuckles of an empty hand for so many seconds."""
    hand, script = f"hand-{side}", lab.hands[side]
    meets, at = lab.approach(hand, target, height, turn=script.quaternion), np.array(lab.where[target][0])
    lab.look(at)
    dent = Dent(0.0024, seconds, 0.0264)
    script.over(meets.place(at, 0.08), script.position[1])
    script.go(meets.place(at, dent.apart), 0.6)
    script.wait(0.2)
    tap = script.tap(script.now + 0.05 + dent.period / 2.0, dent.period, AWAY, dent.amplitude)
    _plant(lab, hand, target, dent, tap, meets.slack, note)
    script.go(meets.place(at, 0.08))


def come_close(lab: Lab, side: str, target: str, height: float, clearance: float) -> None:
    """Stop an empty hand ``clearance`` metres before a standing glass and draw back: a near miss."""
    hand, script = f"hand-{side}", lab.hands[side]
    meets, at = lab.approach(hand, target, height, turn=script.quaternion), np.array(lab.where[target][0])
    script.over(meets.place(at, 0.08), script.position[1])
    script.go(meets.place(at, clearance), 0.8)
    arrived = script.now
    script.quiet.append((arrived - 0.1, arrived + 0.6))
    script.wait(0.5)
    lab.secure(arrived, script.now)
    lab.fact("near_miss", arrived + lab.late, script.now + lab.late, (hand, target), clearance_m=clearance)
    script.go(meets.place(at, 0.08))


def _plant(lab: Lab, a: str, b: str, dent: Dent, tap: Tap, slack: float, note: str) -> None:
    lab.tapped(a, b, dent, tap, slack, note)
    lab.secure(tap.start, tap.start + tap.period + 0.1)
