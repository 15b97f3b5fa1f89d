"""Titration of sodium carbonate with hydrochloric acid: two end points, of which the second is twice the first."""

from sessions.model.scene import SceneEffect
from sessions.synthetic.bench import liquid
from sessions.synthetic.experiments.lab import Lab
from sessions.synthetic.experiments.record import Experiment
from sessions.synthetic.experiments.titration import OUTFLOW, bench, titrate

SODA_ML, SODA_MOLAR, ACID_MOLAR, ACID_ML = 20.0, 0.05, 0.1, 50.0
# One proton for each carbonate, then another for each hydrogen carbonate.
FIRST_ML = SODA_ML * SODA_MOLAR / ACID_MOLAR


def perform(lab: Lab) -> None:
    """Run in past the second end point."""
    titrate(lab, (FIRST_ML, 2.0 * FIRST_ML))


CARBONATE_TITRATION = Experiment(
    "carbonate-titration",
    (
        "Titration of 20 mL sodium carbonate with hydrochloric acid, methyl orange as indicator.",
        "Two end points: hydrogen carbonate, then carbonic acid; what bubbles is carbon dioxide.",
    ),
    bench(liquid(SODA_ML, "Na2CO3", SODA_MOLAR), liquid(ACID_ML, "HCl", ACID_MOLAR)),
    (0.034, 0.034),
    perform,
    (
        OUTFLOW,
        SceneEffect("mixing", {"in": ["flask"]}),
        SceneEffect("reaction", {"equation": "Na2CO3 + 2 HCl -> 2 NaCl + H2O + CO2"}),
        # The range as this scene takes it; textbooks give it from 3.1 to 4.4.
        SceneEffect("colour", {
            "in": "flask", "indicator": "methyl orange", "from_ph": 3.1, "to_ph": 4.4, "acid_colour": "red",
            "base_colour": "yellow",
        }),
    ),
    parents={"stopcock": "burette"},
)  # fmt: skip
