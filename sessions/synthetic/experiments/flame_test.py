"""Flame test: a wire is dipped into salts and held into a flame, long enough to show a colour, once not long enough."""

import numpy as np

from sessions.geometry.rotations import turned_about
from sessions.synthetic.bench import BENCH_TOP
from sessions.synthetic.experiments.lab import UP, Lab
from sessions.synthetic.experiments.steps import come_close, look_first
from sessions.synthetic.paths import minimum_jerk_inverse

TIP_IN_FLAME = 0.015
ENTER_FROM, ENTER_S = 0.08, 0.7
SIDEWAYS = turned_about((0.0, 0.0, 1.0), -0.5 * np.pi)
# Body, time the tip rests in the middle of the flame. 0.15 s of rest make a visit of 0.6 s: too short.
RESTS = (("sodium", 2.5), ("potassium", 0.15), ("copper", 3.0))


def perform(lab: Lab) -> None:
    """Dip, hold into the flame, rinse; for each salt in turn."""
    look_first(lab, "look at the flame", (lab.layout.at("lamp") + 0.1 * UP, 4.0), rest=6.0)
    with lab.task("take the wire"):
        lab.grasp("right", "wire", lab.layout.site("wire", "grip"))
    for number, (vessel, rest) in enumerate(RESTS):
        formula = lab.declared("flame-test")["dips"][vessel]
        if number == 2:
            lab.stage("embodied cognition")
        with lab.task(f"test {formula}"):
            _dip(lab, "acid")
            _dip(lab, vessel)
            _hold_in_flame(lab, formula, rest)
    with lab.task("put the wire back"):
        home = np.array(lab.layout.placed["wire"].position)
        lab.carry("right", home + 0.2 * UP, high=BENCH_TOP + 0.25, quaternion=(0.0, 0.0, 0.0, 1.0))
        lab.put_back("right", BENCH_TOP + 0.2, 0.05, rest=True)
        come_close(lab, "left", "copper", 0.05, 0.005)
        lab.rest("left")
        lab.wait(9.0)


def _dip(lab: Lab, vessel: str) -> None:
    """Lower the wire's tip into a beaker and lift it out."""
    place = np.array(lab.where[vessel][0])
    lab.carry("right", place + 0.11 * UP, high=BENCH_TOP + 0.21, quaternion=(0.0, 0.0, 0.0, 1.0))
    lab.carry("right", place + 0.014 * UP)
    start = lab.hands["right"].now
    lab.hands["right"].wait(float(lab.rng.uniform(0.8, 1.4)))
    lab.fact("dip", start + lab.late, lab.hands["right"].now + lab.late, ("wire", vessel))
    lab.carry("right", place + 0.11 * UP)


def _hold_in_flame(lab: Lab, formula: str, rest: float) -> None:
    """Bring the tip level into the cone and out again; when it crosses the cone follows from the reach's formula."""
    wick = lab.layout.at("lamp") + lab.layout.site("lamp", "flame")
    middle = wick + TIP_IN_FLAME * UP
    before = middle + np.array([ENTER_FROM, 0.0, 0.0])
    above = before + 0.14 * UP + np.array([0.05, 0.0, 0.0])
    lab.carry("right", above, quaternion=SIDEWAYS)
    lab.carry("right", before)
    script = lab.hands["right"]
    script.wait(0.2)
    start = script.now
    lab.carry("right", middle, ENTER_S)
    script.wait(rest)
    out = script.now
    script.quiet.append((start, out + ENTER_S))
    lab.carry("right", before, ENTER_S)
    flame = lab.declared("flame-test")
    share = 1.0 - flame["flame_radius"] * (1.0 - TIP_IN_FLAME / flame["flame_height"]) / ENTER_FROM
    entered = start + ENTER_S * minimum_jerk_inverse(share)
    left = out + ENTER_S * minimum_jerk_inverse(1.0 - share)
    lab.fact(
        "flame", entered + lab.late, left + lab.late, ("lamp", "wire"),
        salt=formula, seen=flame["colours"][formula] if left - entered >= flame["seconds"] else "",
    )  # fmt: skip
    lab.carry("right", above)
