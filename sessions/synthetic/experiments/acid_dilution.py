"""Dilution of sulfuric acid: acid into water, stirred; then the mistakes: a spill, water into acid, a drop."""

from sessions.model.scene import SceneEffect
from sessions.synthetic.bench import BENCH_TOP, Placed, in_rack, liquid, rack_at, standing
from sessions.synthetic.experiments.lab import SPOUT_LEFT, Lab
from sessions.synthetic.experiments.record import Experiment
from sessions.synthetic.experiments.steps import pour, rap, stir

WATER_ML, ACID_ML, RINSE_ML = 120.0, 40.0, 60.0
# Concentrated sulfuric acid, 96 % by mass, 1.84 g/mL: 18.0 mol/L.
ACID_MOLAR = 18.0
# What is left of its 1,840 g/L is water: 75 g/L over 18.015 g/mol.
WATER_MOLAR = 4.1
# Thomsen's formula as this scene takes it: 17,860 n / (n + 1.798) cal for n mol of water per mol of acid.
HEAT_J_MOL, HALF_WATER = 17860.0 * 4.184, 1.798
THRESHOLD_SPEED = 1.5
RACK_AT = (0.36, -0.10)


def perform(lab: Lab) -> None:
    """Dilute as one should, then spill, pour in the wrong order, and drop a beaker."""
    lab.stage("virtual reality")
    with lab.task("look at the bench"):
        for x in (0.15, 0.0, -0.25):
            lab.look((x, 0.95, 0.0))
            lab.wait(3.2)
    lab.stage("perceptual interaction")
    with lab.task("pour acid into water in two portions"):
        lab.grasp("right", "acid", (0.0, 0.05, 0.0))
        pour(lab, "right", "water", 8.0, seconds=6.0)
        lab.hands["right"].wait(1.5)
        pour(lab, "right", "water", 7.0, seconds=6.0)
        lab.put_back("right")
    with lab.task("stir"):
        lab.grasp("right", "rod", lab.layout.site("rod", "grip"))
        stir(lab, "right", "water", 15.0, touches=(0.02, 0.3))
        lab.put_back("right", 1.16, 0.05, rest=True)
    lab.stage("embodied cognition")
    with lab.task("pour a third portion and spill"):
        lab.grasp("right", "acid", (0.0, 0.05, 0.0))
        pour(lab, "right", "water", 3.0, seconds=3.0, beside=0.06)
        lab.put_back("right", rest=True)
    with lab.task("pour water into acid, the wrong order"):
        away = lab.where["rinse"][0]
        lab.grasp("left", "rinse", (0.0, 0.05, 0.0))
        pour(lab, "left", "acid", 5.0, seconds=3.0)
        wrong = max((fact for fact in lab.facts if fact.kind == "pour"), key=lambda fact: fact.start)
        lab.note("wrong_order", wrong.start, wrong.end, ("acid", "rinse"), water_ml=5.0)
        lab.hands["left"].wait(0.5)
    with lab.task("drop the beaker"):
        lab.carry("left", (away[0] - 0.06, BENCH_TOP + 0.22, away[2] + 0.06), high=BENCH_TOP + 0.24)
        lab.hands["left"].wait(0.4)
        lab.drop("left", THRESHOLD_SPEED)
        lab.leave("left")
        lab.rest("left")
    with lab.task("touch the diluted acid's beaker"):
        rap(lab, "left", "water", 0.06, 0.6, note="a hand touches the warm beaker")
        lab.rest("left")
        lab.wait(2.0)


ACID_DILUTION = Experiment(
    "acid-dilution",
    (
        "Dilution of sulfuric acid: acid into water, never water into acid.",
        "A beaker that lands faster than 1.5 m/s breaks. Glasses stand 0.1 mm above the bench.",
    ),
    {
        "rack": rack_at(*RACK_AT),
        "acid": Placed(
            "beaker_50",
            standing(0.14, 0.05),
            SPOUT_LEFT,
            properties=liquid(ACID_ML, "H2SO4", ACID_MOLAR, water_molar=WATER_MOLAR),
        ),
        "water": Placed("beaker_250", standing(-0.06, 0.0), properties=liquid(WATER_ML)),
        "rinse": Placed("beaker_100", standing(-0.28, 0.06), properties=liquid(RINSE_ML)),
        "rod": in_rack(*RACK_AT),
    },
    (0.034, 0.034),
    perform,
    (
        SceneEffect("contact", {"between": ["tag:hand", "tag:glass"]}),
        SceneEffect("contact", {"between": ["rod", "tag:vessel"]}),
        SceneEffect("contact", {"between": ["tag:vessel", "tag:bench"]}),
        SceneEffect("grasp", {"between": ["tag:hand", "tag:glass"]}),
        SceneEffect("pour", {"from": ["acid", "rinse"], "into": ["water", "acid"]}),
        SceneEffect("mixing", {"in": ["water", "acid"]}),
        SceneEffect("heat", {
            "of": "dilution", "solute": "H2SO4", "ambient_c": 20.0, "loss_w_per_k": 0.15, "heat_j_mol": HEAT_J_MOL,
            "half_water": HALF_WATER, "heat_capacity_j_per_ml_k": 4.0,
        }),
        SceneEffect("breakage", {"between": ["tag:vessel", "bench"], "speed_m_s": THRESHOLD_SPEED}),
    ),
    version=2,
)  # fmt: skip
