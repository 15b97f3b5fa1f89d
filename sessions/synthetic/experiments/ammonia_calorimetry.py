"""Calorimetry: hydrochloric acid is poured into ammonia in a vessel of known heat capacity, which warms."""

from sessions.model.scene import SceneEffect
from sessions.synthetic.bench import Placed, in_rack, liquid, rack_at, standing
from sessions.synthetic.experiments.lab import SPOUT_LEFT, Lab
from sessions.synthetic.experiments.record import Experiment
from sessions.synthetic.experiments.steps import come_close, pour, rap, stir

AMMONIA_ML, ACID_ML, POURED_ML, MOLAR = 40.0, 40.0, 25.0, 1.0
ROOM_C, VESSEL_J_K, PER_ML = 20.0, 25.0, 4.18
# NH3(aq) + H+ -> NH4+: -132.51 + 80.29 kJ/mol (NBS tables, 1982).
HEAT_J_MOL = 52.22e3

RACK_AT = (0.34, -0.08)


def perform(lab: Lab) -> None:
    """Look, pour, read."""
    lab.stage("virtual reality")
    with lab.task("look at the calorimeter"):
        lab.look(lab.layout.at("calorimeter"), after=3.0)
        lab.wait(4.0)
    lab.stage("perceptual interaction")
    with lab.task("pour acid into ammonia"):
        lab.grasp("right", "acid", (0.0, 0.05, 0.0))
        pour(lab, "right", "calorimeter", POURED_ML, seconds=5.0)
        start = max(fact.start for fact in lab.facts if fact.kind == "pour")
        lab.put_back("right")
    # Ammonia is in excess: each proton of the acid gives its heat to liquids and vessel.
    given = POURED_ML * 1e-3 * MOLAR * HEAT_J_MOL
    warmest = ROOM_C + given / (PER_ML * (AMMONIA_ML + POURED_ML) + VESSEL_J_K)
    lab.note("temperature", start, lab.now, ("calorimeter",), from_c=ROOM_C, to_c=warmest)
    with lab.task("stir"):
        lab.grasp("right", "rod", lab.layout.site("rod", "grip"))
        stir(lab, "right", "calorimeter", 12.0, radius=0.009)
        lab.put_back("right", 1.15, 0.05, rest=True)
    lab.stage("embodied cognition")
    with lab.task("read the thermometer"):
        come_close(lab, "left", "calorimeter", 0.06, 0.005)
        rap(lab, "left", "calorimeter", 0.055, 0.3, note="knuckles touch the beaker")
        lab.rest("left")
        lab.wait(8.0)


AMMONIA_CALORIMETRY = Experiment(
    "ammonia-calorimetry",
    ("Calorimetry of NH3 + HCl -> NH4Cl, without loss to the room.", "Glasses stand 0.1 mm above the bench."),
    {
        "rack": rack_at(*RACK_AT),
        "rod": in_rack(*RACK_AT),
        "calorimeter": Placed(
            "beaker_100",
            standing(-0.06, 0.02),
            properties={**liquid(AMMONIA_ML, "NH3", MOLAR), "heat_capacity_j_per_k": VESSEL_J_K},
        ),
        "acid": Placed("beaker_50", standing(0.13, 0.04), SPOUT_LEFT, properties=liquid(ACID_ML, "HCl", MOLAR)),
    },
    (0.034, 0.034),
    perform,
    (
        SceneEffect("pour", {"from": ["acid"], "into": ["calorimeter"]}),
        SceneEffect("mixing", {"in": ["calorimeter"]}),
        SceneEffect("reaction", {"equation": "NH3 + HCl -> NH4Cl"}),
        SceneEffect("heat", {
            "of": "neutralisation", "ambient_c": ROOM_C, "loss_w_per_k": 0.0, "heat_capacity_j_per_ml_k": PER_ML,
        }),
    ),
)  # fmt: skip
