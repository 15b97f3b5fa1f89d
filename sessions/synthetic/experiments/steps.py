"""Steps of a procedure that have a truth: pour, stir, swirl, rap, come close."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sessions.synthetic.analytic import ROUNDING_M
from sessions.synthetic.bench import cylinder_of
from sessions.synthetic.choreography import Quaternion
from sessions.synthetic.easing import minimum_jerk, minimum_jerk_inverse
from sessions.synthetic.experiments.lab import UP, Lab
from sessions.synthetic.experiments.pouring import tilt_keeping
from sessions.synthetic.paths import Stir, Tap
from sessions.synthetic.planting import Dent
from sessions.synthetic.rotations import quaternion_about, quaternion_product, rotated
from sessions.synthetic.sections import approach, round_in_round
from sessions.synthetic.truth import ordered

Array = NDArray[np.float64]

STEP_S = 0.02
LEVER_M = 0.25
AWAY = (0.0, 0.0, -1.0)
# Farther than the rim and the spout of any vessel poured from, so that it clears the target while still upright.
CLEAR_OF_RIM = 0.02
POUR_FROM = 0.03


@dataclass
class Vessels:
    """How much stands in each vessel, millilitres; what was spilled is kept under ``spilled``."""

    volumes: dict[str, float] = field(default_factory=dict)
    spilled: float = 0.0

    def move(self, source: str, target: str | None, millilitres: float) -> None:
        """Move liquid; without a target it is spilled."""
        self.volumes[source] -= millilitres
        if target is None:
            self.spilled += millilitres
        else:
            self.volumes[target] = self.volumes.get(target, 0.0) + millilitres


@dataclass(frozen=True)
class Pour:
    """One pour: how much, how slowly, and how far beside the middle of the target's opening."""

    millilitres: float
    seconds: float = 4.0
    hold: float = 0.6
    beside: float = 0.0


def pour(lab: Lab, vessels: Vessels, side: str, target: str, how: Pour) -> None:
    """Tilt the held vessel about its lip until ``how.millilitres`` have left it, then right it again.

    Truth: quasi-statically the vessel keeps what its tilt allows, so the liquid runs from the tilt that keeps all of
    it (``start``) to the greatest tilt (``end``).
    """
    source = lab.held[side]
    instrument = lab.layout.instruments[source]
    radius, height = cylinder_of(instrument)
    before = vessels.volumes[source]
    onset = tilt_keeping(before * 1e-6, radius, height)
    greatest = tilt_keeping((before - how.millilitres) * 1e-6, radius, height)
    opening = instrument.cavity.opening  # type: ignore[union-attr]
    assert opening is not None
    turn = lab.where[source][1]
    forward = rotated(turn, opening.pour_direction)
    middle = _mouth(lab, target) + how.beside * forward
    lip = np.array(opening.lip)
    high = lip[1] + CLEAR_OF_RIM
    lab.carry(side, middle + high * UP - rotated(turn, lip), high=lab.travel - 0.1)
    lab.hands[side].wait(0.3)
    start = lab.hands[side].now
    share = np.linspace(0.0, 1.0, round(how.seconds / STEP_S) + 1)[1:]
    _tilt(
        lab, side, middle, lip, high, greatest * minimum_jerk(share), minimum_jerk(share), start + share * how.seconds
    )
    lab.hands[side].wait(how.hold)
    back = 0.6 * how.seconds
    down = lab.hands[side].now
    eased = 1.0 - minimum_jerk(share)
    _tilt(lab, side, middle, lip, high, greatest * eased, eased, down + share * back, turn)
    begins = start + how.seconds * minimum_jerk_inverse(onset / greatest) + lab.late
    ends = start + how.seconds + lab.late
    missed = abs(how.beside) > _mouth_radius(lab, target)
    vessels.move(source, None if missed else target, how.millilitres)
    lab.note(
        "spill" if missed else "pour", begins, ends, (source,) if missed else (source, target),
        volume_ml=how.millilitres, source=source, target="" if missed else target, left_ml=vessels.volumes[source],
        onset_tilt_deg=float(np.degrees(onset)), greatest_tilt_deg=float(np.degrees(greatest)),
    )  # fmt: skip


def _tilt(
    lab: Lab,
    side: str,
    middle: Array,
    lip: Array,
    high: float,
    angles: Array,
    lowered: Array,
    times: Array,
    upright: Quaternion | None = None,
) -> None:
    """Tilt the held vessel to these angles about its lip, which sinks from ``high`` to `POUR_FROM` over the target."""
    turn = np.array(upright if upright is not None else lab.where[lab.held[side]][1])
    opening = lab.layout.instruments[lab.held[side]].cavity.opening  # type: ignore[union-attr]
    assert opening is not None
    axis = np.cross(UP, rotated(turn, opening.pour_direction))
    turns = quaternion_product(quaternion_about(axis, angles), turn)
    lips = middle + (high + (POUR_FROM - high) * lowered)[:, None] * UP
    lab.follow(side, times, lips - rotated(turns, lip), turns)


def _mouth(lab: Lab, vessel: str) -> Array:
    """Middle of a standing vessel's opening."""
    cavity = lab.layout.instruments[vessel].cavity
    assert cavity is not None and cavity.opening is not None
    position, quaternion = lab.where[vessel]
    middle: Array = np.array(position) + rotated(quaternion, cavity.opening.centre)
    return middle


def _mouth_radius(lab: Lab, vessel: str) -> float:
    cavity = lab.layout.instruments[vessel].cavity
    assert cavity is not None and cavity.opening is not None
    return float(cavity.opening.radius)


def stir(
    lab: Lab, side: str, vessel: str, seconds: float, *, radius: float = 0.012, touches: Sequence[float] = ()
) -> None:
    """Stir in a vessel with the held rod, ``touches`` times (lasting so many seconds each) against its wall."""
    rod, script = lab.held[side], lab.hands[side]
    cavity = lab.layout.instruments[vessel].cavity
    assert cavity is not None
    tip_height = cavity.floor_height + 0.018
    place = np.array(lab.where[vessel][0]) + tip_height * UP
    top = float(_mouth(lab, vessel)[1]) + 0.04
    lab.carry(side, np.array([place[0], top, place[2]]), high=max(top, lab.travel - 0.15))
    lab.carry(side, place)
    start, turns = script.now, float(lab.rng.uniform(1.0, 1.3))
    taps = []
    if touches:
        sure, possible = round_in_round(lab.layout.mesh(rod), lab.layout.mesh(vessel), tip_height)
        apart, slack = 0.5 * (sure + possible) - radius, 0.5 * (sure - possible)
        for number, length in enumerate(touches):
            dent = Dent(0.0026, length, apart + 0.0026)
            centre = start + 1.2 + (seconds - 2.4) * (number + 0.5) / len(touches)
            tap = Tap(centre - dent.period / 2.0, dent.period, (0.0, 0.0, 0.0), dent.amplitude)
            taps.append((tap.start, tap.period, tap.amplitude))
            _plant(lab, vessel, rod, dent, tap, slack, "the rod touches the wall")
    turn = Stir(start, start + seconds, radius, turns, taps=tuple(taps))
    script.overlays.append(turn)
    script.quiet.append((start, start + seconds))
    script.wait_until(start + seconds)
    values: dict[str, float | str] = {"turns_per_second": turns, "radius_m": radius}
    lab.note("stir", start + lab.late, script.now + lab.late, (rod, vessel), **values)
    lab.carry(side, np.array([place[0], top, place[2]]))


def swirl(lab: Lab, side: str, seconds: float, *, radius: float = 0.006) -> None:
    """Swirl the held vessel in small circles."""
    script = lab.hands[side]
    start, turns = script.now, float(lab.rng.uniform(1.2, 1.6))
    script.overlays.append(Stir(start, start + seconds, radius, turns))
    script.wait_until(start + seconds)
    values: dict[str, float | str] = {"turns_per_second": turns, "radius_m": radius}
    lab.note("swirl", start + lab.late, script.now + lab.late, (lab.held[side],), **values)


def rap(lab: Lab, side: str, target: str, height: float, seconds: float, *, note: str) -> None:
    """Touch a standing glass with the knuckles of an empty hand for so many seconds."""
    hand, script = f"hand-{side}", lab.hands[side]
    meets = approach(lab.layout.mesh(hand), script.quaternion, lab.layout.mesh(target), AWAY, height)
    at = np.array(lab.where[target][0])
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
    meets = approach(lab.layout.mesh(hand), script.quaternion, lab.layout.mesh(target), AWAY, height)
    at = np.array(lab.where[target][0])
    script.over(meets.place(at, 0.08), script.position[1])
    script.go(meets.place(at, clearance), 0.8)
    arrived = script.now
    script.quiet.append((arrived - 0.1, arrived + 0.6))
    script.wait(0.5)
    lab.secure(arrived, script.now)
    lab.note("near_miss", arrived + lab.late, script.now + lab.late, (hand, target), clearance_m=clearance)
    script.go(meets.place(at, 0.08))


def _plant(lab: Lab, a: str, b: str, dent: Dent, tap: Tap, slack: float, note: str) -> None:
    noise = lab.how.tracker.margin(LEVER_M, 1) if lab.how.tracker else 0.0
    clock = (lab.late, lab.how.seconds)
    lab.episodes += dent.episodes(ordered(a, b), tap, 10.0 * ROUNDING_M + slack + noise, clock, note)
    lab.secure(tap.start, tap.start + tap.period + 0.1)
