"""Steps of the flame test: a wire is dipped into salts and held into a flame."""

import numpy as np

from sessions.geometry.rotations import turned_about
from sessions.synthetic.bench import BENCH_TOP
from sessions.synthetic.experiments.lab import UP, Lab
from sessions.synthetic.paths import minimum_jerk_inverse

TIP_IN_FLAME = 0.015
ENTER_FROM, ENTER_S = 0.08, 0.7
SIDEWAYS = turned_about((0.0, 0.0, 1.0), -0.5 * np.pi)


def dip(lab: Lab, vessel: str) -> None:
    """Lower the wire's tip into a beaker and lift it out."""
    place = np.array(lab.where[vessel][0])
    lab.carry("right", place + 0.11 * UP, high=BENCH_TOP + 0.21, quaternion=(0.0, 0.0, 0.0, 1.0))
    lab.carry("right", place + 0.014 * UP)
    start = lab.hands["right"].now
    lab.hands["right"].wait(float(lab.rng.uniform(0.8, 1.4)))
    lab.fact("dip", start + lab.late, lab.hands["right"].now + lab.late, ("wire", vessel))
    lab.carry("right", place + 0.11 * UP)


def hold_in_flame(lab: Lab, salt: str, rest: float) -> None:
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
        salt=salt, seen=flame["colours"][salt] if left - entered >= flame["seconds"] else "",
    )  # fmt: skip
    lab.carry("right", above)
