"""What stands in the vessels of a scene at first; a formula or number that cannot be is refused."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from replay.effects.models.equation import COMMON, atoms, ion_of, molar_mass
from replay.effects.models.species import IONS, MOST_MOLAR
from replay.effects.vessels import Vessel
from replay.errors import EffectError, PlanError
from sessions.model.scene import Scene

WATER: Final = "H2O"
WATER_MOLAR: Final = 55.41
"""mol/L of pure water at 20 degC: 998.2 g/L over 18.015 g/mol. Source: CRC Handbook (density), IUPAC 2021 (weights)."""

MOST_G_L: Final = 2500.0
"""Of a solute in a litre: more than any common salt dissolves to (zinc iodide and caesium formate come near)."""


@dataclass(frozen=True, eq=False)
class Contents:
    """What is in a vessel at first: millilitres, and formula -> mol dissolved and solid."""

    volume_ml: float
    amounts: Mapping[str, float]
    solids: Mapping[str, float]


def contents_of_scene(scene: Scene, file: str) -> dict[str, Contents]:
    """Body -> what the scene says is in it. Raises PlanError: formulas and numbers that cannot be."""
    contents: dict[str, Contents] = {}
    faults: list[str] = []
    for body in scene.bodies:
        properties = body.extra.get("properties") or {}
        try:
            if properties.get("liquid") or properties.get("solid"):
                contents[body.id] = contents_of(Vessel(body))
        except EffectError as error:
            faults.append(f"{file}: {str(error).removeprefix('scene: ')}")
    if faults:
        raise PlanError(*faults)
    return contents


def contents_of(vessel: Vessel) -> Contents:
    """What the scene says is in a vessel at first; ``H2O`` is counted in pure water and where the scene tells it.

    Raises EffectError: a formula or a number that cannot be.
    """
    liquid, litres = vessel.contents("liquid"), vessel.volume_ml * 1e-3
    amounts: dict[str, float] = {}
    solutes = _solutes(vessel, liquid)
    for text, molar in solutes.items():
        formula = _formula(vessel, text)
        if formula in amounts:
            raise vessel.fail(f"holds {formula!r} twice; give one concentration")
        most = MOST_MOLAR.get(formula, MOST_G_L / molar_mass(formula))
        if molar > most:
            raise vessel.fail(f"holds {molar:g} mol/L of {formula!r}; the strongest solution of it has {most:.3g}")
        amounts[formula] = litres * molar
    if "water_molar" in liquid:
        amounts[WATER] = litres * vessel.amount("liquid", "water_molar")
    elif not solutes:
        amounts[WATER] = litres * WATER_MOLAR
    solids: dict[str, float] = {}
    if vessel.contents("solid"):
        formula = _formula(vessel, str(vessel.contents("solid").get("formula")))
        solids[formula] = vessel.amount("solid", "mass_g") / molar_mass(formula)
    return Contents(vessel.volume_ml, amounts, solids)


def _solutes(vessel: Vessel, liquid: Mapping[str, Any]) -> dict[str, float]:
    """Formula, as written -> mol/L."""
    told = liquid.get("solutes") or {}
    if not isinstance(told, Mapping):
        raise vessel.fail(f"has liquid.solutes = {told!r}; give a table: formula = mol/L")
    solutes = {str(key): vessel.amount("liquid", str(key), within=told) for key in told}
    solute = liquid.get("solute", "")
    if not isinstance(solute, str) or (liquid.get("molar") and not solute):
        raise vessel.fail(f"has liquid.solute = {solute!r}; give the formula of what liquid.molar is of")
    if solute in solutes:
        raise vessel.fail(f"holds {solute!r} twice; give one concentration")
    if solute:
        solutes[solute] = vessel.amount("liquid", "molar")
    return solutes


def _formula(vessel: Vessel, text: str) -> str:
    formula = ion_of(text, IONS)
    try:
        atoms(formula)
    except ValueError as error:
        raise vessel.fail(f"holds {error}") from error
    # AgNo3 would be silver and nobelium.
    meant = next((one for one in COMMON if one.lower() == formula.lower() and one != formula), "")
    if meant:
        raise vessel.fail(f"holds {formula!r}; did you mean {meant!r}?")
    return formula
