"""Calorimetry: hydrochloric acid is poured into ammonia in a vessel of known heat capacity, which warms."""

from sessions.synthetic.experiments.lab import Lab
from sessions.synthetic.experiments.steps import look_first, pour_once, stir_and_look

POURED_ML = 25.0
# NH3(aq) + H+ -> NH4+: -132.51 + 80.29 kJ/mol (NBS tables, 1982).
HEAT_J_MOL = 52.22e3


def perform(lab: Lab) -> None:
    """Look, pour, read."""
    look_first(lab, "look at the calorimeter", (lab.layout.at("calorimeter"), 3.0), rest=4.0)
    start = pour_once(lab, "pour acid into ammonia", "acid", "calorimeter", POURED_ML)
    # Ammonia is in excess: each proton of the acid gives its heat to liquids and vessel.
    heat, vessel = lab.declared("heat"), lab.held_by("calorimeter")
    given = POURED_ML * 1e-3 * lab.held_by("acid")["liquid"]["molar"] * HEAT_J_MOL
    liquids = heat["heat_capacity_j_per_ml_k"] * (vessel["liquid"]["volume_ml"] + POURED_ML)
    warmest = heat["ambient_c"] + given / (liquids + vessel["heat_capacity_j_per_k"])
    lab.fact("temperature", start, lab.now, ("calorimeter",), from_c=heat["ambient_c"], to_c=warmest)
    stir_and_look(lab, "calorimeter", "read the thermometer")
