"""Flame test: a wire is dipped into salts and held into a flame, long enough to show a colour, once not long enough."""

import numpy as np

from sessions.geometry.rotations import turned_about
from sessions.model.scene import SceneEffect
from sessions.synthetic.bench import BENCH_TOP, Placed, in_rack, liquid, rack_at, standing
from sessions.synthetic.experiments.lab import UP, Lab
from sessions.synthetic.experiments.record import Experiment
from sessions.synthetic.experiments.steps import come_close
from sessions.synthetic.paths import minimum_jerk_inverse

# The flame as the scene declares it: a cone that stands on the wick.
FLAME_RADIUS, FLAME_HEIGHT, TIP_IN_FLAME = 0.009, 0.045, 0.015
# The wick's top, where the flame stands, in the lamp's frame: its site "flame".
WICK = (0.0, 0.0982, 0.0)
SEEN_AFTER_S = 1.0
ENTER_FROM, ENTER_S = 0.08, 0.7
SIDEWAYS = turned_about((0.0, 0.0, 1.0), -0.5 * np.pi)
RACK_AT = (0.48, -0.02)
# Salt, body, time the tip rests in the middle of the flame. 0.15 s of rest make a visit of 0.6 s: too short.
SALTS = (("NaCl", "sodium", 2.5, "yellow"), ("KCl", "potassium", 0.15, "violet"), ("CuSO4", "copper", 3.0, "green"))


def perform(lab: Lab) -> None:
    """Dip, hold into the flame, rinse; for each salt in turn."""
    lab.stage("virtual reality")
    with lab.task("look at the flame"):
        lab.look(lab.layout.at("lamp") + 0.1 * UP, after=4.0)
        lab.wait(6.0)
    lab.stage("perceptual interaction")
    with lab.task("take the wire"):
        lab.grasp("right", "wire", lab.layout.site("wire", "grip"))
    for number, (formula, vessel, rest, colour) in enumerate(SALTS):
        if number == 2:
            lab.stage("embodied cognition")
        with lab.task(f"test {formula}"):
            _dip(lab, "acid")
            _dip(lab, vessel)
            _hold_in_flame(lab, formula, rest, colour)
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
    lab.note("dip", start + lab.late, lab.hands["right"].now + lab.late, ("wire", vessel))
    lab.carry("right", place + 0.11 * UP)


def _hold_in_flame(lab: Lab, formula: str, rest: float, colour: str) -> None:
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
    share = 1.0 - FLAME_RADIUS * (1.0 - TIP_IN_FLAME / FLAME_HEIGHT) / ENTER_FROM
    entered = start + ENTER_S * minimum_jerk_inverse(share)
    left = out + ENTER_S * minimum_jerk_inverse(1.0 - share)
    lab.note(
        "flame", entered + lab.late, left + lab.late, ("lamp", "wire"),
        salt=formula, seen=colour if left - entered >= SEEN_AFTER_S else "",
    )  # fmt: skip
    lab.carry("right", above)


FLAME_TEST = Experiment(
    "flame-test",
    (
        "Flame test of sodium, potassium and copper salts with a wire, here a glass rod with a platinum tip.",
        "The flame is a cone on the lamp's wick. A tip that stays for one second shows its colour.",
    ),
    {
        "rack": rack_at(*RACK_AT),
        "lamp": Placed("alcohol_lamp", standing(-0.05, 0.02), moves=False, tags=("hot", "flame")),
        "acid": Placed("beaker_50", standing(0.20, 0.08), properties=liquid(20.0, "HCl", 1.0)),
        "sodium": Placed("beaker_50", standing(0.10, -0.10), properties=liquid(20.0, "NaCl", 1.0)),
        "potassium": Placed("beaker_50", standing(0.0, -0.13), properties=liquid(20.0, "KCl", 1.0)),
        "copper": Placed("beaker_50", standing(-0.20, -0.06), properties=liquid(20.0, "CuSO4", 1.0)),
        "wire": in_rack(*RACK_AT, tags=("wire",)),
    },
    (0.034, 0.01),
    perform,
    (
        SceneEffect("contact", {"between": ["tag:hand", "tag:glass"]}),
        SceneEffect("contact", {"between": ["wire", "tag:vessel"]}),
        SceneEffect("grasp", {"between": ["tag:hand", "wire"]}),
        SceneEffect("flame-test", {
            "flame": "lamp", "base": list(WICK), "flame_radius": FLAME_RADIUS, "flame_height": FLAME_HEIGHT,
            "wire": "wire", "tip": [0.0, 0.0, 0.0], "seconds": SEEN_AFTER_S,
            "colours": {formula: colour for formula, _, _, colour in SALTS},
            "vessels": [vessel for _, vessel, _, _ in SALTS],
            "dips": {vessel: formula for formula, vessel, _, _ in SALTS},
        }),
        SceneEffect("hazard-proximity", {"of": ["tag:hand", "headset"], "hazard": "lamp", "distance": 0.12}),
    ),
    travel=1.28,
)  # fmt: skip
