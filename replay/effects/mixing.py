"""What is in each vessel after all that was poured and run in: perfectly mixed, volumes added."""

from typing import Final

import numpy as np

from replay.effects.declaring import bodies
from replay.effects.inputs import EffectInputs
from replay.effects.models.transfers import Contents, Liquids, Transfer, mixture
from replay.effects.output import EffectOutput, Findings, Series
from replay.effects.protocol import EffectSpec
from replay.effects.vessels import Vessel, vessels_of

MOVERS: Final = ("pour", "burette")

WATER: Final = "H2O"

WATER_MOLAR: Final = 55.41
"""mol/L of pure water at 20 degC: 998.2 g/L over 18.015 g/mol. Source: CRC Handbook (density), IUPAC 2021 (weights)."""


def compute(inputs: EffectInputs) -> EffectOutput:
    """Volume, concentrations and level of each vessel wherever they change; the whole `Mixture` for chemistry."""
    names: dict[str, None] = {name: None for declared in inputs.declared for name in declared.bodies("in")}
    moved: list[Transfer] = []
    shown = tuple(names)
    for kind in MOVERS:
        if inputs.has(kind):
            liquids: Liquids = inputs.output(kind).data
            names.update(dict.fromkeys(liquids.initial_ml))
            moved += liquids.transfers
    vessels = vessels_of(inputs, tuple(names))
    mixed = mixture({name: contents_of(vessel) for name, vessel in vessels.items()}, moved, inputs.times)
    found = Findings(len(inputs))
    for one in moved:
        found.ran[one.frame] |= one.source in shown or one.target in shown
    inputs.count("transfers mixed", len(moved))
    for name in shown:
        history = mixed.histories[name]
        found.series[f"{name}/volume"] = Series(history.times, history.volume_ml, "mL")
        litres = np.where(history.volume_ml > 0.0, history.volume_ml * 1e-3, np.nan)
        for formula, amount in history.amounts.items():
            if formula not in (WATER, *contents_of(vessels[name]).solids):
                found.series[f"{name}/{formula} as brought"] = Series(history.times, amount / litres, "mol/L")
        found.liquids[name] = vessels[name].drawn(history.times, history.volume_ml)
    return found.output(mixed)


def contents_of(vessel: Vessel) -> Contents:
    """What the scene says is in a vessel at first; ``H2O`` is counted in pure water and where the scene tells it."""
    liquid = vessel.contents("liquid")
    litres = vessel.volume_ml * 1e-3
    contents = Contents(vessel.volume_ml)
    solute = str(liquid.get("solute") or "")
    if solute:
        contents.amounts[solute] = litres * vessel.amount("liquid", "molar")
    if "water_molar" in liquid:
        contents.amounts[WATER] = litres * vessel.amount("liquid", "water_molar")
    elif not solute:
        contents.amounts[WATER] = litres * WATER_MOLAR
    solid = vessel.contents("solid")
    if solid:
        mass, weight = (vessel.amount("solid", key) for key in ("mass_g", "molar_mass"))
        if weight <= 0.0:
            raise vessel.fail("has solid.molar_mass = 0; give it in g/mol")
        contents.solids[str(solid.get("formula") or "solid")] = mass / weight
    return contents


SPEC = EffectSpec(
    kind="mixing",
    about="Liquids that come together mix.",
    compute=compute,
    uses=MOVERS,
    fields={"in": bodies("vessels to follow")},
    trigger="liquid that enters or leaves one of the vessels",
    sources=(
        "perfect mixing and additive volumes: simplifications of this model",
        f"pure water {WATER_MOLAR} mol/L at 20 degC: density 0.9982 g/mL (CRC Handbook), 18.015 g/mol (IUPAC 2021)",
    ),
)
