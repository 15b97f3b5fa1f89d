"""What the chemistry of an experiment makes of what was done, from formulas, written down as facts."""

import math
from typing import Any

import numpy as np

from sessions.synthetic.experiments.lab import Lab

# g/mol, from Ag 107.868, Cl 35.45, Ca 40.078, C 12.011, O 15.999 (IUPAC standard atomic weights, abridged, 2021).
SILVER_CHLORIDE_G_MOL = 143.32
MARBLE_G_MOL = 100.086
# NH3(aq) + H+ -> NH4+: -132.51 + 80.29 kJ/mol (NBS tables, 1982).
AMMONIA_J_MOL = 52.22e3


def note_precipitate(lab: Lab, vessel: str) -> None:
    """All silver that was poured falls out as chloride."""
    _, moles = _poured(lab)
    _since_poured(lab, "precipitate", vessel, formula="AgCl", moles=moles, mass_g=moles * SILVER_CHLORIDE_G_MOL)


def note_dissolved(lab: Lab, vessel: str) -> None:
    """Acid in excess takes all of the marble, two protons for each carbonate; what is left over gives the pH."""
    marble_g, (poured_ml, moles) = lab.held_by(vessel)["solid"]["mass_g"], _poured(lab)
    left = moles - 2.0 * marble_g / MARBLE_G_MOL
    ph = -math.log10(left / (poured_ml * 1e-3))
    _since_poured(lab, "dissolve", vessel, formula="CaCO3", mass_g=marble_g, ph=ph)


def note_warmed(lab: Lab, vessel: str) -> None:
    """Ammonia is in excess: each proton of the acid gives its heat to liquids and vessel."""
    heat, held, (poured_ml, moles) = lab.declared("heat"), lab.held_by(vessel), _poured(lab)
    given = moles * AMMONIA_J_MOL
    liquids = heat["heat_capacity_j_per_ml_k"] * (held["liquid"]["volume_ml"] + poured_ml)
    warmest = heat["ambient_c"] + given / (liquids + held["heat_capacity_j_per_k"])
    _since_poured(lab, "temperature", vessel, from_c=heat["ambient_c"], to_c=warmest)


def note_wrong_order(lab: Lab) -> None:
    """The last pour brought water into acid."""
    pour = lab.last("pour")
    lab.fact("wrong_order", pour.start, pour.end, pour.bodies, water_ml=pour.values["volume_ml"])


def note_white(lab: Lab, vessel: str) -> None:
    """When the salt has lost its water: m c dT/dt = P - k (T - Ta) since it was set over the flame."""
    heat, capacity, set_down = _over_flame(lab, vessel)
    loss = heat["loss_w_per_k"]
    dried = set_down - capacity / loss * np.log1p(-(heat["turns_c"] - heat["ambient_c"]) * loss / heat["power_w"])
    lab.fact("white", float(dried), float(dried), (vessel,), celsius=heat["turns_c"])


def note_burn(lab: Lab, vessel: str, hand: str) -> None:
    """The latest touch burns the hand, by the temperature that the vessel has by then."""
    touch = max(lab.episodes, key=lambda episode: episode.possibly).nominal
    assert touch is not None
    heat, capacity, set_down = _over_flame(lab, vessel)
    loss = heat["loss_w_per_k"]
    warmed = 1.0 - float(np.exp(-(touch[0] - set_down) * loss / capacity))
    hot = float(heat["ambient_c"] + heat["power_w"] / loss * warmed)
    lab.fact("burn", *touch, (vessel, hand), surface_c=hot, seconds=touch[1] - touch[0])


def note_heated(lab: Lab, vessel: str, lamp: str) -> None:
    """The vessel was over the flame until now."""
    _, _, set_down = _over_flame(lab, vessel)
    mass = lab.held_by(vessel)["solid"]["mass_g"]
    lab.fact("heat", set_down, lab.last("grasp").start, (vessel, lamp), salt_g=mass)


def _poured(lab: Lab) -> tuple[float, float]:
    """Millilitres and moles of the last pour."""
    values = lab.last("pour").values
    millilitres, source = float(values["volume_ml"]), str(values["source"])
    return millilitres, millilitres * 1e-3 * lab.held_by(source)["liquid"]["molar"]


def _since_poured(lab: Lab, kind: str, vessel: str, **values: float | str) -> None:
    lab.fact(kind, lab.last("pour").start, lab.now, (vessel,), **values)


def _over_flame(lab: Lab, vessel: str) -> tuple[Any, float, float]:
    """The declared heating, the vessel's heat capacity (J/K), and when it was set down over the flame."""
    capacity = lab.held_by(vessel)["heat_capacity_j_per_k"]
    return lab.declared("heat"), capacity, lab.last("release", vessel).start
