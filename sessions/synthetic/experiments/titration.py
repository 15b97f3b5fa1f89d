"""Titration of hydrochloric acid with sodium hydroxide: run in, throttle, close just past the end point.

The scene declares no effect that needs a contact: replaying it asks no collision detector anything.
"""

import numpy as np

from sessions.geometry.rotations import Array, quaternion_about, turned_about
from sessions.synthetic.bench import BENCH_TOP, standing
from sessions.synthetic.choreography import Script
from sessions.synthetic.experiments.lab import Lab
from sessions.synthetic.experiments.pouring import Outlet, Turn
from sessions.synthetic.experiments.steps import look_first, swirl
from sessions.synthetic.paths import Path, Poses

STAND_AT = (0.0, -0.09)
AXIS = (0.0, 0.0, 1.0)
FAST, SLOW = np.radians(40.0), np.radians(7.0)
# The flask stands on the foot of the stand, 12 mm over the bench.
FOOT = BENCH_TOP + 0.012
UNDER = (0.0, STAND_AT[1] + 0.06)


def perform(lab: Lab) -> None:
    """Bring the flask, run in quickly, throttle, stop after the colour has changed."""
    titrate(lab, (equivalence_ml(lab),))


def equivalence_ml(lab: Lab) -> float:
    """What of the burette's solution brings as much as the flask holds, millilitres."""
    flask, burette = (lab.held_by(body)["liquid"] for body in ("flask", "burette"))
    return float(flask["volume_ml"] * flask["molar"] / burette["molar"])


def titrate(lab: Lab, ends_ml: tuple[float, ...]) -> None:
    """Run in past the last of these end points, each of which is noted with its time."""
    look_first(lab, "look at the burette", ((0.0, 1.45, STAND_AT[1]), 5.0), ((0.2, 0.95, 0.05), 5.0), rest=3.0)
    with lab.task("bring the flask under the burette"):
        lab.grasp("right", "flask", lab.layout.site("flask", "neck") - np.array([0.0, 0.045, 0.0]))
        lab.carry("right", (UNDER[0] + 0.12, FOOT + 0.02, UNDER[1] + 0.05), high=FOOT + 0.02)
        lab.carry("right", (UNDER[0], FOOT + 0.006, UNDER[1]), 1.0)
    outlet = _run_in(lab, ends_ml[-1])
    lab.stage("embodied cognition")
    with lab.task("put the flask aside and read the burette"):
        lab.carry("right", (UNDER[0] + 0.12, FOOT + 0.02, UNDER[1] + 0.08), 1.0)
        lab.place("right", standing(0.2, 0.1))
        lab.leave("right")
        lab.rest("right")
        lab.look((0.0, 1.5, STAND_AT[1]))
        lab.wait(6.0)
    delivered = float(outlet.volume(lab.now)) * 1e6
    for volume in ends_ml:
        end_point = outlet.time_of(volume * 1e-6, 600.0)
        lab.fact("end_point", end_point, end_point, ("burette", "flask"), volume_ml=volume)
    lab.fact("delivered", outlet.turns[0].start, outlet.turns[-1].end, ("burette", "flask"), volume_ml=delivered)
    lab.joints["stopcock"] = _stopcock(lab, outlet)


def _run_in(lab: Lab, last_ml: float) -> Outlet:
    left = lab.hands["left"]
    knob = lab.layout.at("burette") + lab.layout.site("burette", "stopcock")
    with lab.task("run in the base"):
        left.go(knob + np.array([-0.012, -0.01, 0.15]))
        left.go(knob + np.array([-0.012, -0.01, 0.09]), 0.6)
        lab.together()
        left.wait(0.4)
        turns = [_turn(left, lab.late, 0.0, FAST, 0.9)]
        cavity, declared = lab.layout.cavity("burette"), lab.declared("burette")
        section = float(cavity.capacity_m3 / (cavity.mark_height - cavity.floor_height))
        outlet = Outlet(declared["full_area_m2"], declared["discharge"], section, float(cavity.mark_height), turns)
        nearly = outlet.time_of(0.88 * last_ml * 1e-6, 600.0)
        swirl(lab, "right", nearly - lab.hands["right"].now)
        left.wait_until(nearly)
        turns.append(_turn(left, lab.late, FAST, SLOW, 0.9))
        end_point = outlet.time_of(last_ml * 1e-6, 600.0)
        swirl(lab, "right", end_point + 1.5 - lab.hands["right"].now)
        left.wait_until(end_point + 0.8)
        turns.append(_turn(left, lab.late, SLOW, 0.0, 0.5))
        lab.together()
        left.go((-0.2, 1.1, 0.28))
    for turn in turns:
        angles = {"from_deg": float(np.degrees(turn.start_angle)), "to_deg": float(np.degrees(turn.end_angle))}
        lab.fact("stopcock", turn.start, turn.end, ("stopcock",), **angles)
    return outlet


def _turn(hand: Script, late: float, start: float, end: float, seconds: float) -> Turn:
    """Turn the key with the hand; it turns with what the hand is seen to do."""
    began = hand.now + late
    hand.go(hand.position, seconds, quaternion=turned_about(AXIS, 0.6 * end))
    return Turn(began, began + seconds, start, end)


def _stopcock(lab: Lab, outlet: Outlet) -> Path:
    """Pose of the key relative to the burette."""
    place = lab.layout.site("burette", "stopcock")

    def path(times: Array) -> Poses:
        angle = np.zeros_like(times)
        for turn in outlet.turns:
            after = times >= turn.start
            angle[after] = [turn.angle(time) for time in times[after]]
        return np.tile(place, (len(times), 1)), quaternion_about(AXIS, angle)

    return path
