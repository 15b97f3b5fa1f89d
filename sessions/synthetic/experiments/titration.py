"""Titration of hydrochloric acid with sodium hydroxide: run in, throttle, close just past the end point.

The scene declares no effect that needs a contact: replaying it asks no collision detector anything.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from sessions.geometry.rotations import Array, quaternion_about, turned_about
from sessions.model.scene import SceneEffect
from sessions.synthetic.bench import BENCH_TOP, Placed, liquid, standing
from sessions.synthetic.choreography import Script
from sessions.synthetic.experiments.lab import Lab
from sessions.synthetic.experiments.pouring import Outlet, Turn
from sessions.synthetic.experiments.record import Experiment
from sessions.synthetic.experiments.steps import swirl
from sessions.synthetic.paths import Path, Poses

ACID_ML, ACID_MOLAR, BASE_MOLAR, BASE_ML = 25.0, 0.1, 0.1, 50.0
EQUIVALENCE_ML = ACID_ML * ACID_MOLAR / BASE_MOLAR
# Open area at a quarter turn and discharge coefficient of this made-up stopcock: 1.1 mL/s fully open at 50 cm.
FULL_AREA_M2, DISCHARGE = 6.0e-7, 0.6
STAND_AT = (0.0, -0.09)
TIP_HEIGHT = 0.175
AXIS = (0.0, 0.0, 1.0)
FAST, SLOW = np.radians(40.0), np.radians(7.0)
# The flask stands on the foot of the stand, 12 mm over the bench.
FOOT = BENCH_TOP + 0.012
UNDER = (0.0, STAND_AT[1] + 0.06)


def perform(lab: Lab) -> None:
    """Bring the flask, run in quickly, throttle, stop after the colour has changed."""
    titrate(lab, (EQUIVALENCE_ML,))


def titrate(lab: Lab, ends_ml: tuple[float, ...]) -> None:
    """Run in past the last of these end points, each of which is noted with its time."""
    lab.stage("virtual reality")
    with lab.task("look at the burette"):
        lab.look((0.0, 1.45, STAND_AT[1]), after=5.0)
        lab.look((0.2, 0.95, 0.05), after=5.0)
        lab.wait(3.0)
    lab.stage("perceptual interaction")
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
        lab.note("end_point", end_point, end_point, ("burette", "flask"), volume_ml=volume)
    lab.note("delivered", outlet.turns[0].start, outlet.turns[-1].end, ("burette", "flask"), volume_ml=delivered)
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
        cavity = lab.layout.cavity("burette")
        section = float(cavity.capacity_m3 / (cavity.mark_height - cavity.floor_height))
        outlet = Outlet(FULL_AREA_M2, DISCHARGE, section, float(cavity.mark_height), turns)
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
        lab.note("stopcock", turn.start, turn.end, ("stopcock",), **angles)
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


def bench(flask: Mapping[str, Any], burette: Mapping[str, Any]) -> dict[str, Placed]:
    """What stands on the bench of a titration, with what is in the two."""
    return {
        "stand": Placed("stand", (STAND_AT[0], BENCH_TOP, STAND_AT[1]), moves=False),
        "burette": Placed(
            "burette", (STAND_AT[0], BENCH_TOP + TIP_HEIGHT, STAND_AT[1] + 0.06), moves=False, properties=burette
        ),
        "stopcock": Placed("burette_stopcock", (0.0, 0.1, 0.0)),
        "flask": Placed("erlenmeyer_flask", standing(0.22, 0.06), properties=flask),
        "bottle": Placed("reagent_bottle", standing(-0.34, -0.06)),
    }


OUTFLOW = SceneEffect("burette", {
    "body": "burette", "joint": "stopcock", "into": ["flask"], "full_area_m2": FULL_AREA_M2, "full_angle_deg": 90.0,
    "discharge": DISCHARGE,
})  # fmt: skip

TITRATION = Experiment(
    "titration",
    (
        "Titration of 25 mL hydrochloric acid with sodium hydroxide, phenolphthalein as indicator.",
        "No effect here needs a contact: no collision detector runs.",
        "The key's pose is relative to the burette; its angle about Z opens the outlet: full_area_m2 at 90 degrees.",
    ),
    bench(liquid(ACID_ML, "HCl", ACID_MOLAR), liquid(BASE_ML, "NaOH", BASE_MOLAR)),
    (0.034, 0.034),
    perform,
    (
        OUTFLOW,
        SceneEffect("mixing", {"in": ["flask"]}),
        SceneEffect("reaction", {"equation": "HCl + NaOH -> NaCl + H2O"}),
        # The range as this scene takes it; textbooks give it from 8.0 to 8.3 up to 9.6 to 10.0.
        SceneEffect("colour", {
            "in": "flask", "indicator": "phenolphthalein", "from_ph": 8.2, "to_ph": 10.0,
            "acid_colour": "colourless", "base_colour": "pink",
        }),
    ),
    parents={"stopcock": "burette"},
)  # fmt: skip
