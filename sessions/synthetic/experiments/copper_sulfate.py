"""Heating copper sulfate: the dish is set over the flame, the salt stirred until white, and a hand gets burnt."""

import numpy as np

from sessions.model.scene import SceneEffect
from sessions.synthetic.bench import BENCH_TOP, STAND_M, Placed, in_rack, rack_at, standing
from sessions.synthetic.experiments.lab import Lab
from sessions.synthetic.experiments.record import Experiment
from sessions.synthetic.experiments.steps import come_close, rap, stir

TRIPOD_AT = (-0.02, -0.02)
GAUZE_HEIGHT = 0.2099
GAUZE_THICKNESS = 0.0024
ON_GAUZE = standing(*TRIPOD_AT, GAUZE_HEIGHT + GAUZE_THICKNESS + STAND_M)
# A hand about the dish reaches 45 mm below its grip and must stay off what the dish stands on.
GRIP_HEIGHT = 0.05
# The flame heats what stands less than this beside its axis.
HEATS_WITHIN = 0.02
RACK_AT = (0.40, -0.10)
SALT_G, SALT_MOLAR_MASS = 5.0, 249.68  # CuSO4.5H2O, from IUPAC abridged atomic weights 2021
# CRC Handbook: 2.286 g/mL; at 110 degC four of its five waters have gone, and it is white.
SALT_DENSITY, WHITE_AT_C = 2.286, 110.0
# What the flame gives the dish and what it loses to the room: chosen so that it is 120 degrees after 43 s.
WICK = (0.0, 0.0982, 0.0)
AMBIENT_C, POWER_W, LOSS_W_PER_K, CAPACITY_J_PER_K = 20.0, 160.0, 0.4, 60.0


def perform(lab: Lab) -> None:
    """Set the dish over the flame, stir, touch it, take it off with the bare hand."""
    lab.stage("virtual reality")
    with lab.task("look at the flame"):
        lab.look(lab.layout.at("lamp"), after=4.0)
        lab.look(lab.layout.at("dish"), after=5.0)
        lab.wait(3.0)
    lab.stage("perceptual interaction")
    with lab.task("set the dish on the gauze"):
        lab.grasp("right", "dish", (0.0, GRIP_HEIGHT, 0.0))
        lab.place("right", ON_GAUZE, high=BENCH_TOP + 0.34)
        begun = lab.last("release").start
        lab.leave("right")
    dried = begun - CAPACITY_J_PER_K / LOSS_W_PER_K * np.log1p(-(WHITE_AT_C - AMBIENT_C) * LOSS_W_PER_K / POWER_W)
    lab.note("white", float(dried), float(dried), ("dish",), celsius=WHITE_AT_C)
    with lab.task("stir while it dries"):
        lab.grasp("right", "rod", lab.layout.site("rod", "grip"))
        stir(lab, "right", "dish", 20.0, radius=0.01)
        lab.put_back("right", BENCH_TOP + 0.36, 0.1, rest=True)
        lab.wait(8.0)
    lab.stage("embodied cognition")
    with lab.task("look at the white salt"):
        come_close(lab, "left", "dish", GRIP_HEIGHT, 0.006)
        rap(lab, "left", "dish", GRIP_HEIGHT, 0.8, note="a hand touches the hot dish")
        burn = max(lab.episodes, key=lambda episode: episode.possibly)
        assert burn.nominal is not None
        length = burn.nominal[1] - burn.nominal[0]
        hot = _celsius(burn.nominal[0] - begun)
        lab.note("burn", *burn.nominal, ("dish", "hand-left"), surface_c=hot, seconds=length)
        lab.rest("left")
    with lab.task("take the dish off with the bare hand"):
        lab.grasp("right", "dish", (0.0, GRIP_HEIGHT, 0.0))
        lab.note("heat", begun, lab.last("grasp").start, ("dish", "lamp"), salt_g=SALT_G)
        lab.put_back("right", BENCH_TOP + 0.34, rest=True)
        lab.wait(3.0)


def _celsius(seconds: float) -> float:
    """Temperature of the dish after so long over the flame: m c dT/dt = P - k (T - Ta)."""
    return AMBIENT_C + POWER_W / LOSS_W_PER_K * (1.0 - float(np.exp(-seconds * LOSS_W_PER_K / CAPACITY_J_PER_K)))


COPPER_SULFATE = Experiment(
    "copper-sulfate",
    (
        "Copper sulfate pentahydrate is heated in a porcelain dish until it is white.",
        "The dish is hot while the lamp stands under it and long after: a hand on it is a burn.",
    ),
    {
        "tripod": Placed("tripod", (TRIPOD_AT[0], BENCH_TOP, TRIPOD_AT[1]), moves=False),
        "gauze": Placed("wire_gauze", standing(*TRIPOD_AT, GAUZE_HEIGHT), moves=False, tags=("hot",)),
        "dish": Placed("evaporating_dish", standing(0.2, 0.08), properties={
            "solid": {
                "formula": "CuSO4.5H2O", "mass_g": SALT_G, "density_g_ml": SALT_DENSITY,
            },
            "heat_capacity_j_per_k": CAPACITY_J_PER_K,
        }),
        "lamp": Placed("alcohol_lamp", standing(*TRIPOD_AT), moves=False, tags=("flame", "hot")),
        "tongs": Placed("tongs", standing(-0.32, 0.05)),
        "rack": rack_at(*RACK_AT),
        "rod": in_rack(*RACK_AT),
    },
    (0.034, 0.045),
    perform,
    (
        SceneEffect("contact", {"between": ["tag:hand", "dish"]}),
        SceneEffect("contact", {"between": ["rod", "dish"]}),
        SceneEffect("grasp", {"between": ["tag:hand", "dish"]}),
        SceneEffect("heat", {
            "of": "flame", "source": "lamp", "heats": "dish", "within": HEATS_WITHIN, "base": list(WICK),
            "power_w": POWER_W, "loss_w_per_k": LOSS_W_PER_K, "ambient_c": AMBIENT_C,
            "turns_c": WHITE_AT_C, "from_colour": "blue", "to_colour": "white",
        }),
        SceneEffect("burn-exposure", {"between": ["tag:hand", "dish"], "seconds": 0.5, "threshold_c": 65.0}),
        SceneEffect("hazard-proximity", {"of": ["tag:hand", "headset"], "hazard": "lamp", "distance": 0.12}),
    ),
    travel=1.32,
)  # fmt: skip
