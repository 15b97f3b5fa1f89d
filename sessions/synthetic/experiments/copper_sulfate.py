"""Heating copper sulfate: the dish is set over the flame, the salt stirred until white, and a hand gets burnt."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from sessions.synthetic.bench import BENCH_TOP, STAND_M, standing
from sessions.synthetic.experiments.lab import Lab
from sessions.synthetic.experiments.steps import come_close, look_first, rap, stir_once

TRIPOD_AT = (-0.02, -0.02)
GAUZE_HEIGHT = 0.2099
GAUZE_THICKNESS = 0.0024
ON_GAUZE = standing(*TRIPOD_AT, GAUZE_HEIGHT + GAUZE_THICKNESS + STAND_M)
# A hand about the dish reaches 45 mm below its grip and must stay off what the dish stands on.
GRIP_HEIGHT = 0.05


def perform(lab: Lab) -> None:
    """Set the dish over the flame, stir, touch it, take it off with the bare hand."""
    look_first(lab, "look at the flame", (lab.layout.at("lamp"), 4.0), (lab.layout.at("dish"), 5.0), rest=3.0)
    with lab.task("set the dish on the gauze"):
        lab.grasp("right", "dish", (0.0, GRIP_HEIGHT, 0.0))
        lab.place("right", ON_GAUZE, high=BENCH_TOP + 0.34)
        begun = lab.last("release").start
        lab.leave("right")
    heat, dish = lab.declared("heat"), lab.held_by("dish")
    loss, capacity = heat["loss_w_per_k"], dish["heat_capacity_j_per_k"]
    dried = begun - capacity / loss * np.log1p(-(heat["turns_c"] - heat["ambient_c"]) * loss / heat["power_w"])
    lab.fact("white", float(dried), float(dried), ("dish",), celsius=heat["turns_c"])
    with lab.task("stir while it dries"):
        stir_once(lab, "dish", 20.0, radius=0.01, high=BENCH_TOP + 0.36, by=0.1)
        lab.wait(8.0)
    lab.stage("embodied cognition")
    with lab.task("look at the white salt"):
        come_close(lab, "left", "dish", GRIP_HEIGHT, 0.006)
        rap(lab, "left", "dish", GRIP_HEIGHT, 0.8, note="a hand touches the hot dish")
        burn = max(lab.episodes, key=lambda episode: episode.possibly)
        assert burn.nominal is not None
        length = burn.nominal[1] - burn.nominal[0]
        hot = _celsius(burn.nominal[0] - begun, heat, capacity)
        lab.fact("burn", *burn.nominal, ("dish", "hand-left"), surface_c=hot, seconds=length)
        lab.rest("left")
    with lab.task("take the dish off with the bare hand"):
        lab.grasp("right", "dish", (0.0, GRIP_HEIGHT, 0.0))
        lab.fact("heat", begun, lab.last("grasp").start, ("dish", "lamp"), salt_g=dish["solid"]["mass_g"])
        lab.put_back("right", BENCH_TOP + 0.34, rest=True)
        lab.wait(3.0)


def _celsius(seconds: float, heat: Mapping[str, Any], capacity: float) -> float:
    """Temperature of the dish after so long over the flame: m c dT/dt = P - k (T - Ta)."""
    power, loss = heat["power_w"], heat["loss_w_per_k"]
    return float(heat["ambient_c"] + power / loss * (1.0 - float(np.exp(-seconds * loss / capacity))))
