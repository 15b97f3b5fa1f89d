"""The step of a titration: run in from the burette, throttle, close just past the end point."""

import numpy as np

from sessions.geometry.rotations import Array, quaternion_about, turned_about
from sessions.synthetic.choreography import Script
from sessions.synthetic.experiments.lab import Lab
from sessions.synthetic.experiments.pouring import Outlet, Turn
from sessions.synthetic.experiments.steps import swirl
from sessions.synthetic.paths import Path, Poses

AXIS = (0.0, 0.0, 1.0)
FAST, SLOW = np.radians(40.0), np.radians(7.0)
# Nobody runs in for longer.
LATEST_S = 600.0


def run_in(lab: Lab, end_points: int) -> None:
    """Run in quickly, throttle, close just past the last of ``end_points``, each as far from the one before it."""
    flask, held = (lab.held_by(body)["liquid"] for body in ("flask", "burette"))
    # What of the burette's solution brings as much as the flask holds.
    first_ml = float(flask["volume_ml"] * flask["molar"] / held["molar"])
    last = end_points * first_ml * 1e-6
    left = lab.hands["left"]
    knob = lab.layout.at("burette") + lab.layout.site("burette", "stopcock")
    left.go(knob + np.array([-0.012, -0.01, 0.15]))
    left.go(knob + np.array([-0.012, -0.01, 0.09]), 0.6)
    lab.together()
    left.wait(0.4)
    turns = [_turn(left, lab.late, 0.0, FAST, 0.9)]
    cavity, declared = lab.layout.cavity("burette"), lab.declared("burette")
    section = float(cavity.capacity_m3 / (cavity.mark_height - cavity.floor_height))
    outlet = Outlet(declared["full_area_m2"], declared["discharge"], section, float(cavity.mark_height), turns)
    nearly = outlet.time_of(0.88 * last, LATEST_S)
    swirl(lab, "right", nearly - lab.hands["right"].now)
    left.wait_until(nearly)
    turns.append(_turn(left, lab.late, FAST, SLOW, 0.9))
    end_point = outlet.time_of(last, LATEST_S)
    swirl(lab, "right", end_point + 1.5 - lab.hands["right"].now)
    left.wait_until(end_point + 0.8)
    turns.append(_turn(left, lab.late, SLOW, 0.0, 0.5))
    lab.together()
    left.go((-0.2, 1.1, 0.28))
    for turn in turns:
        angles = {"from_deg": float(np.degrees(turn.start_angle)), "to_deg": float(np.degrees(turn.end_angle))}
        lab.fact("stopcock", turn.start, turn.end, ("stopcock",), **angles)
    for number in range(1, end_points + 1):
        end_point = outlet.time_of(number * first_ml * 1e-6, LATEST_S)
        lab.fact("end_point", end_point, end_point, ("burette", "flask"), volume_ml=number * first_ml)
    delivered = outlet.volume(turns[-1].end) * 1e6
    lab.fact("delivered", turns[0].start, turns[-1].end, ("burette", "flask"), volume_ml=delivered)
    lab.joints["stopcock"] = _stopcock(lab, outlet)


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
