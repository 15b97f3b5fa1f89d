"""Marble in acid: hydrochloric acid is poured on calcium carbonate, all of which dissolves."""

import math

from sessions.synthetic.experiments.lab import Lab
from sessions.synthetic.experiments.steps import look_first, pour_once, stir_and_look

POURED_ML = 25.0
# g/mol: Ca 40.078 + C 12.011 + 3 O 15.999 (IUPAC standard atomic weights, abridged, 2021).
MARBLE_G_MOL = 100.086


def perform(lab: Lab) -> None:
    """Look, pour, look again."""
    look_first(lab, "look at the marble", (lab.layout.at("marble"), 3.0), rest=4.0)
    start = pour_once(lab, "pour acid on the marble", "acid", "marble", POURED_ML)
    # Acid in excess takes all of it, two protons for each; what is left over gives the pH.
    marble_g, molar = lab.held_by("marble")["solid"]["mass_g"], lab.held_by("acid")["liquid"]["molar"]
    left = POURED_ML * 1e-3 * molar - 2.0 * marble_g / MARBLE_G_MOL
    ph = -math.log10(left / (POURED_ML * 1e-3))
    lab.fact("dissolve", start, lab.now, ("marble",), formula="CaCO3", mass_g=marble_g, ph=ph)
    stir_and_look(lab, "marble", "look at what is left")
