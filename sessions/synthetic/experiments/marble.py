"""Marble in acid: hydrochloric acid is poured on calcium carbonate, all of which dissolves."""

import math

from sessions.model.scene import SceneEffect
from sessions.synthetic.bench import Placed, in_rack, liquid, rack_at, standing
from sessions.synthetic.experiments.lab import SPOUT_LEFT, Lab
from sessions.synthetic.experiments.record import Experiment
from sessions.synthetic.experiments.steps import come_close, pour, rap, stir

ACID_ML, POURED_ML, ACID_MOLAR = 40.0, 25.0, 0.5
# g/mol: Ca 40.078 + C 12.011 + 3 O 15.999 (IUPAC standard atomic weights, abridged, 2021).
MARBLE_G, MARBLE_G_MOL = 0.4, 100.086

RACK_AT = (0.34, -0.08)


def perform(lab: Lab) -> None:
    """Look, pour, look again."""
    lab.stage("virtual reality")
    with lab.task("look at the marble"):
        lab.look(lab.layout.at("marble"), after=3.0)
        lab.wait(4.0)
    lab.stage("perceptual interaction")
    with lab.task("pour acid on the marble"):
        lab.grasp("right", "acid", (0.0, 0.05, 0.0))
        pour(lab, "right", "marble", POURED_ML, seconds=5.0)
        start = max(fact.start for fact in lab.facts if fact.kind == "pour")
        lab.put_back("right")
    # Acid in excess takes all of it, two protons for each; what is left over gives the pH.
    left = POURED_ML * 1e-3 * ACID_MOLAR - 2.0 * MARBLE_G / MARBLE_G_MOL
    ph = -math.log10(left / (POURED_ML * 1e-3))
    lab.note("dissolve", start, lab.now, ("marble",), formula="CaCO3", mass_g=MARBLE_G, ph=ph)
    with lab.task("stir"):
        lab.grasp("right", "rod", lab.layout.site("rod", "grip"))
        stir(lab, "right", "marble", 12.0, radius=0.009)
        lab.put_back("right", 1.15, 0.05, rest=True)
    lab.stage("embodied cognition")
    with lab.task("look at what is left"):
        come_close(lab, "left", "marble", 0.06, 0.005)
        rap(lab, "left", "marble", 0.055, 0.3, note="knuckles touch the beaker")
        lab.rest("left")
        lab.wait(8.0)


MARBLE = Experiment(
    "marble",
    ("Marble in acid: CaCO3 + 2 HCl -> CaCl2 + H2O + CO2.", "Glasses stand 0.1 mm above the bench."),
    {
        "rack": rack_at(*RACK_AT),
        "rod": in_rack(*RACK_AT),
        "marble": Placed(
            "beaker_100", standing(-0.06, 0.02), properties={"solid": {"formula": "CaCO3", "mass_g": MARBLE_G}}
        ),
        "acid": Placed("beaker_50", standing(0.13, 0.04), SPOUT_LEFT, properties=liquid(ACID_ML, "HCl", ACID_MOLAR)),
    },
    (0.034, 0.034),
    perform,
    (
        SceneEffect("contact", {"between": ["tag:hand", "tag:glass"]}),
        SceneEffect("contact", {"between": ["rod", "tag:vessel"]}),
        SceneEffect("pour", {"from": ["acid"], "into": ["marble"]}),
        SceneEffect("mixing", {"in": ["marble"]}),
        SceneEffect("reaction", {"equation": "CaCO3 + 2 HCl -> CaCl2 + H2O + CO2"}),
        SceneEffect("precipitation", {"solid": "CaCO3", "colour": "white"}),
    ),
)
