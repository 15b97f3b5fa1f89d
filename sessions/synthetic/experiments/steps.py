"""Steps at the bench beside those of `Lab`, each with its truth.

Pour, stir, swirl, rap, come close; a titration; the flame test; collecting a gas over its delivery tube; and what the
chemistry makes of it all, from formulas, written down as facts.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from sessions.geometry.rotations import (
    Array,
    axis_angle_quaternion,
    quaternion_about,
    quaternion_facing,
    quaternion_product,
    rotated_vectors,
)
from sessions.synthetic.bench import BENCH_TOP
from sessions.synthetic.choreography import Script
from sessions.synthetic.experiments.lab import AWAY, UP, Lab
from sessions.synthetic.experiments.pouring import Outlet, StopcockRotation, tilt_keeping
from sessions.synthetic.paths import Dent, Key, Poses, PosesAt, Stir, Tap, minimum_jerk, minimum_jerk_inverse
from sessions.synthetic.sections import Approach, round_in_round

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
    source, script = lab.grasped[side], lab.hands[side]
    cavity = lab.layout.cavity(source)
    before = lab.volumes[source]
    onset, greatest = (tilt_keeping(cavity, kept) for kept in (before, before - millilitres))
    quaternion = lab.where[source][1]
    forward = rotated_vectors(quaternion, (1.0, 0.0, 0.0))
    axis, lip = np.cross(UP, forward), np.array(cavity.opening.lip)
    middle = _mouth(lab, target) + beside * forward
    rim_height = lip[1] + CLEAR_OF_RIM
    lab.carry(side, middle + rim_height * UP - rotated_vectors(quaternion, lip), height=lab.travel - 0.1)
    script.wait(0.3)
    fraction = np.linspace(0.0, 1.0, round(seconds / STEP_S) + 1)[1:]

    def tilt(eased: Array, times: Array) -> None:
        """Tilt by a fraction of the angle; the lip sinks by the same fraction from ``rim_height`` to `POUR_FROM`."""
        quaternions = quaternion_product(quaternion_about(axis, greatest * eased), quaternion)
        lips = middle + (rim_height + (POUR_FROM - rim_height) * eased)[:, None] * UP
        lab.follow(side, times, lips - rotated_vectors(quaternions, lip), quaternions)

    start = script.now
    tilt(minimum_jerk(fraction), start + fraction * seconds)
    script.wait(HOLD_S)
    tilt(1.0 - minimum_jerk(fraction), script.now + fraction * (0.6 * seconds))
    begins = start + seconds * minimum_jerk_inverse(onset / greatest) + lab.late
    missed = abs(beside) > lab.layout.cavity(target).opening.radius
    lab.volumes[source] -= millilitres
    lab.volumes[target] += 0.0 if missed else millilitres
    lab.fact(
        "spill" if missed else "pour",
        begins,
        start + seconds + lab.late,
        (source,) if missed else (source, target),
        volume_ml=millilitres,
        source=source,
        target="" if missed else target,
        left_ml=lab.volumes[source],
        onset_tilt_deg=float(np.degrees(onset)),
        greatest_tilt_deg=float(np.degrees(greatest)),
    )


def _mouth(lab: Lab, vessel: str) -> Array:
    """Middle of a standing vessel's opening."""
    position, quaternion = lab.where[vessel]
    return position + rotated_vectors(quaternion, lab.layout.cavity(vessel).opening.centre)


def stir(
    lab: Lab, side: str, vessel: str, seconds: float, *, radius: float = 0.012, touches: Sequence[float] = ()
) -> None:
    """Stir in a vessel with the held rod, ``touches`` times (lasting so many seconds each) against its wall."""
    rod, script = lab.grasped[side], lab.hands[side]
    tip_height = lab.layout.cavity(vessel).floor_height + 0.018
    position = lab.where[vessel][0] + tip_height * UP
    top = float(_mouth(lab, vessel)[1]) + 0.04
    above = np.array([position[0], top, position[2]])
    lab.carry(side, above, height=max(top, lab.travel - 0.15))
    lab.carry(side, position)
    start, revolutions = script.now, float(lab.rng.uniform(1.0, 1.3))
    taps = []
    if touches:
        sure, possible = round_in_round(lab.layout.meshes[rod], lab.layout.meshes[vessel], tip_height)
        gap, slack = 0.5 * (sure + possible) - radius, 0.5 * (sure - possible)
        for number, length in enumerate(touches):
            dent = Dent(0.0026, length, gap + 0.0026)
            tap = dent.tap(start + 1.2 + (seconds - 2.4) * (number + 0.5) / len(touches))
            taps.append(tap)
            _plant(lab, vessel, rod, dent, tap, slack, "the rod touches the wall")
    script.quiet.append((start, start + seconds))
    _circle(lab, side, "stir", Stir(start, start + seconds, radius, revolutions, taps=tuple(taps)), (rod, vessel))
    lab.carry(side, above)


def swirl(lab: Lab, side: str, seconds: float, *, radius: float = 0.006) -> None:
    """Swirl the held vessel in small circles."""
    start, revolutions = lab.hands[side].now, float(lab.rng.uniform(1.2, 1.6))
    _circle(lab, side, "swirl", Stir(start, start + seconds, radius, revolutions), (lab.grasped[side],))


def _circle(lab: Lab, side: str, kind: str, circles: Stir, bodies: tuple[str, ...]) -> None:
    script = lab.hands[side]
    script.overlays.append(circles)
    script.wait_until(circles.end)
    values = {"turns_per_second": circles.revolutions_per_second, "radius_m": circles.radius}
    lab.fact(kind, circles.start + lab.late, script.now + lab.late, bodies, **values)


def rap(lab: Lab, side: str, target: str, height: float, seconds: float, *, note: str) -> None:
    """Touch a standing glass with the knuckles of an empty hand for so many seconds."""
    lab.gaze_at(lab.where[target][0])
    script, meets, at = _approach(lab, side, target, height)
    dent = Dent(0.0024, seconds, 0.0264)
    script.go(meets.origin_at(at, dent.gap), 0.6)
    script.wait(0.2)
    tap = dent.tap(script.now + 0.05 + dent.period / 2.0, AWAY)
    script.tap(tap)
    _plant(lab, f"hand-{side}", target, dent, tap, meets.slack, note)
    script.go(meets.origin_at(at, 0.08))


def come_close(lab: Lab, side: str, target: str, height: float, clearance: float) -> None:
    """Stop an empty hand ``clearance`` metres before a standing glass and draw back: a near miss."""
    script, meets, at = _approach(lab, side, target, height)
    script.go(meets.origin_at(at, clearance), 0.8)
    arrived = script.now
    script.quiet.append((arrived - 0.1, arrived + 0.6))
    script.wait(0.5)
    lab.secure(arrived, script.now)
    bodies = (f"hand-{side}", target)
    lab.fact("near_miss", arrived + lab.late, script.now + lab.late, bodies, clearance_m=clearance)
    script.go(meets.origin_at(at, 0.08))


def _approach(lab: Lab, side: str, target: str, height: float) -> tuple[Script, Approach, Array]:
    """Bring an empty hand 80 mm before a standing thing; its script, where the two meet, and where the thing stands."""
    script, at = lab.hands[side], lab.where[target][0]
    meets = lab.approach(f"hand-{side}", target, height, rotation=script.quaternion)
    script.over(meets.origin_at(at, 0.08), script.position[1])
    return script, meets, at


def _plant(lab: Lab, a: str, b: str, dent: Dent, tap: Tap, slack: float, note: str) -> None:
    lab.tapped(a, b, dent, tap, slack, note)
    lab.secure(tap.start, tap.start + tap.period + 0.1)


AXIS = (0.0, 0.0, 1.0)
FAST, SLOW = np.radians(40.0), np.radians(7.0)
# Nobody runs in for longer.
LATEST_S = 600.0


def run_in(lab: Lab, end_points: int) -> None:
    """Run in quickly, throttle, close just past the last of ``end_points``, each as far from the one before it."""
    flask, capacity = (lab.initial_contents(body)["liquid"] for body in ("flask", "burette"))
    # What of the burette's solution brings as much as the flask holds.
    first_ml = float(flask["volume_ml"] * flask["molar"] / capacity["molar"])
    last = end_points * first_ml * 1e-6
    left = lab.hands["left"]
    knob = lab.layout.at("burette") + lab.layout.site("burette", "stopcock")
    left.go(knob + np.array([-0.012, -0.01, 0.15]))
    left.go(knob + np.array([-0.012, -0.01, 0.09]), 0.6)
    lab.together()
    left.wait(0.4)
    rotations = [_stopcock_rotation(left, lab.late, 0.0, FAST, 0.9)]
    cavity, declared = lab.layout.cavity("burette"), lab.declared("burette")
    section = float(cavity.capacity_m3 / (cavity.mark_height - cavity.floor_height))
    outlet = Outlet(declared["full_area_m2"], declared["discharge"], section, float(cavity.mark_height), rotations)
    nearly = outlet.time_of(0.88 * last, LATEST_S)
    swirl(lab, "right", nearly - lab.hands["right"].now)
    left.wait_until(nearly)
    rotations.append(_stopcock_rotation(left, lab.late, FAST, SLOW, 0.9))
    end_point = outlet.time_of(last, LATEST_S)
    swirl(lab, "right", end_point + 1.5 - lab.hands["right"].now)
    left.wait_until(end_point + 0.8)
    rotations.append(_stopcock_rotation(left, lab.late, SLOW, 0.0, 0.5))
    lab.together()
    left.go((-0.2, 1.1, 0.28))
    for rotation in rotations:
        angles = {"from_deg": float(np.degrees(rotation.start_angle)), "to_deg": float(np.degrees(rotation.end_angle))}
        lab.fact("stopcock", rotation.start, rotation.end, ("stopcock",), **angles)
    for number in range(1, end_points + 1):
        end_point = outlet.time_of(number * first_ml * 1e-6, LATEST_S)
        lab.fact("end_point", end_point, end_point, ("burette", "flask"), volume_ml=number * first_ml)
    delivered = outlet.volume(rotations[-1].end) * 1e6
    lab.fact("delivered", rotations[0].start, rotations[-1].end, ("burette", "flask"), volume_ml=delivered)
    lab.things["stopcock"] = [(0.0, _stopcock(lab, outlet))]


def _stopcock_rotation(hand: Script, late: float, start: float, end: float, seconds: float) -> StopcockRotation:
    """Turn the key with the hand; it turns with what the hand is seen to do."""
    began = hand.now + late
    hand.go(hand.position, seconds, quaternion=axis_angle_quaternion(AXIS, 0.6 * end))
    return StopcockRotation(began, began + seconds, start, end)


def _stopcock(lab: Lab, outlet: Outlet) -> PosesAt:
    """Pose of the key relative to the burette."""
    position = lab.layout.site("burette", "stopcock")

    def path(times: Array, _hands: Mapping[str, Poses]) -> Poses:
        angle = np.zeros_like(times)
        for rotation in outlet.rotations:
            after = times >= rotation.start
            angle[after] = [rotation.angle(time) for time in times[after]]
        return np.tile(position, (len(times), 1)), quaternion_about(AXIS, angle)

    return path


TIP_IN_FLAME = 0.015
ENTER_FROM, ENTER_S = 0.08, 0.7
SIDEWAYS = axis_angle_quaternion((0.0, 0.0, 1.0), -0.5 * np.pi)


def dip(lab: Lab, vessel: str) -> None:
    """Lower the wire's tip into a beaker and lift it out."""
    position = lab.where[vessel][0]
    lab.carry("right", position + 0.11 * UP, height=BENCH_TOP + 0.21, quaternion=(0.0, 0.0, 0.0, 1.0))
    lab.carry("right", position + 0.014 * UP)
    start = lab.hands["right"].now
    lab.hands["right"].wait(float(lab.rng.uniform(0.8, 1.4)))
    lab.fact("dip", start + lab.late, lab.hands["right"].now + lab.late, ("wire", vessel))
    lab.carry("right", position + 0.11 * UP)


def hold_in_flame(lab: Lab, salt: str, rest: float) -> None:
    """Bring the tip level into the cone and out again; when it crosses the cone follows from the reach's formula."""
    wick = lab.layout.at("lamp") + lab.layout.site("lamp", "flame")
    middle = wick + TIP_IN_FLAME * UP
    before = middle + np.array([ENTER_FROM, 0.0, 0.0])
    above = before + 0.14 * UP + np.array([0.05, 0.0, 0.0])
    lab.carry("right", above, quaternion=SIDEWAYS)
    lab.carry("right", before)
    lab.hands["right"].wait(0.2)
    flame = lab.declared("flame-test")
    fraction = 1.0 - flame["flame_radius"] * (1.0 - TIP_IN_FLAME / flame["flame_height"]) / ENTER_FROM
    entered, left = _visit(lab, "right", (before, middle), ENTER_S, rest, fraction)
    lab.fact(
        "flame",
        entered,
        left,
        ("lamp", "wire"),
        salt=salt,
        seen=flame["colours"][salt] if left - entered >= flame["seconds"] else "",
    )
    lab.carry("right", above)


def _visit(
    lab: Lab, side: str, between: tuple[Array, Array], seconds: float, rest: float, fraction: float
) -> tuple[float, float]:
    """Carry the held thing to the second place, rest there, and back, each way in so many seconds.

    When it has come that share of its way, and when it is as far again on its way back, in recorded time.
    """
    outside, inside = between
    script = lab.hands[side]
    start = script.now
    lab.carry(side, inside, seconds)
    script.wait(rest)
    out = script.now
    script.quiet.append((start, out + seconds))
    lab.carry(side, outside, seconds)
    entered = start + seconds * minimum_jerk_inverse(fraction)
    return entered + lab.late, out + seconds * minimum_jerk_inverse(1.0 - fraction) + lab.late


ZINC_MOLAR_MASS = 65.38  # IUPAC abridged atomic weights 2021
JAR_HEIGHT = 0.1991
# The tube ends this far inside the jar, and is lowered over from this far above.
TUBE_LENGTH, TUBE_IN_FLASK = 0.45, 0.11
LOWER_BY, LOWER_S, INSIDE_BY = 0.12, 1.8, 0.09


def set_tube(lab: Lab) -> None:
    """Put the tube on the flask, its lower end inside."""
    flask = lab.where["flask"][0]
    mouth = float(lab.layout.meshes["flask"].bounds[1, 1])
    lab.grasp("left", "tube", (0.0, 0.3, 0.0))
    seat = flask + (mouth - TUBE_IN_FLASK) * UP
    lab.carry("left", seat + 0.16 * UP, height=BENCH_TOP + 0.28)
    lab.put_down("left", seat)
    lab.leave("left", 0.22)
    x, y, z = lab.hands["left"].position
    lab.hands["left"].go((x - 0.2, y, z + 0.1))
    lab.hands["left"].go((-0.28, 1.12, 0.28))


def collect_gas(lab: Lab) -> None:
    """Lower the jar over the tube, wait, lift it off; what is collected follows from the reaction's rate."""
    top = lab.where["tube"][0] + TUBE_LENGTH * UP
    lab.grasp("right", "jar", (0.0, 0.12, 0.0))
    over = top + (JAR_HEIGHT + LOWER_BY - INSIDE_BY) * UP
    lab.carry("right", over, height=float(over[1]))
    entered, left = _visit(lab, "right", (over, over - LOWER_BY * UP), LOWER_S, 22.0, 1.0 - INSIDE_BY / LOWER_BY)
    begun = lab.last("pour").start
    moles, rate = (
        lab.initial_contents("flask")["solid"]["mass_g"] / ZINC_MOLAR_MASS,
        lab.declared("reaction")["rate_per_s"],
    )
    evolved = [moles * (1.0 - float(np.exp(-rate * (time - begun)))) for time in (entered, left)]
    lab.fact(
        "collect",
        entered,
        left,
        ("jar", "tube"),
        collected_mol=evolved[1] - evolved[0],
        leaked_before_mol=evolved[0],
        begun=begun,
        zinc_mol=moles,
    )
    lab.put_back("right", float(over[1]), rest=True)


def note(
    lab: Lab,
    kind: str,
    bodies: Sequence[str],
    since: str,
    *,
    until: str = "",
    after: float = 0.0,
    **values: float | str,
) -> None:
    """Write down what follows from what was done: since the last fact of a kind about the first of the bodies, or so
    many seconds ``after`` it, until the last fact of another kind, or ``now``; without one it is a moment."""
    start = lab.last(since, bodies[0]).start + after
    end = lab.now if until == "now" else lab.last(until).start if until else start
    lab.fact(kind, start, end, bodies, **values)


def note_wrong_order(lab: Lab) -> None:
    """The last pour brought water into acid."""
    pour = lab.last("pour")
    lab.fact("wrong_order", pour.start, pour.end, pour.bodies, water_ml=pour.values["volume_ml"])


def note_burn(lab: Lab, vessel: str, hand: str) -> None:
    """The latest touch burns the hand, by the temperature that the vessel has by then."""
    touch = max(lab.episodes(np.inf), key=lambda episode: episode.possibly).nominal
    assert touch is not None
    heat, capacity = lab.declared("heat"), lab.initial_contents(vessel)["heat_capacity_j_per_k"]
    loss, set_down = heat["loss_w_per_k"], lab.last("release", vessel).start
    warmed = 1.0 - float(np.exp(-(touch[0] - set_down) * loss / capacity))
    hot = float(heat["ambient_c"] + heat["power_w"] / loss * warmed)
    lab.fact("burn", *touch, (vessel, hand), surface_c=hot, seconds=touch[1] - touch[0])


def looking_key(time: float, eyes: Array, at: ArrayLike) -> Key:
    """The head with its eyes (3,) turned to a place."""
    return Key(time, eyes, quaternion_facing(np.asarray(at) - eyes))
