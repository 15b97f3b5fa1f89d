"""Dilution of sulfuric acid: acid into water, stirred; then the mistakes: a spill, water into acid, a drop."""

from sessions.synthetic.bench import BENCH_TOP
from sessions.synthetic.experiments.lab import Lab
from sessions.synthetic.experiments.steps import pour, rap, stir_once


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
        stir_once(lab, "water", 15.0, radius=0.012, touches=(0.02, 0.3), high=1.16)
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
        lab.fact("wrong_order", wrong.start, wrong.end, ("acid", "rinse"), water_ml=5.0)
        lab.hands["left"].wait(0.5)
    with lab.task("drop the beaker"):
        lab.carry("left", (away[0] - 0.06, BENCH_TOP + 0.22, away[2] + 0.06), high=BENCH_TOP + 0.24)
        lab.hands["left"].wait(0.4)
        lab.drop("left", lab.declared("breakage")["speed_m_s"])
        lab.leave("left")
        lab.rest("left")
    with lab.task("touch the diluted acid's beaker"):
        rap(lab, "left", "water", 0.06, 0.6, note="a hand touches the warm beaker")
        lab.rest("left")
        lab.wait(2.0)
