"""Initial contents of the vessels of a scene; a formula or number that cannot be is refused."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from replay.effects.chemistry.components import WATER, components_of
from replay.effects.chemistry.enthalpy import CONSTANTS
from replay.effects.chemistry.formulas import COMMON_FORMULAS, atoms, ion_of, molar_mass
from replay.effects.chemistry.salts import anhydrous, solubility_of
from replay.effects.chemistry.solution_water import REFERENCE_C, expansion, molar_of_molal, water_molar
from replay.effects.vessels import Vessel
from replay.errors import EffectError, PlanError
from replay.words import number
from sessions.model.scene import Scene

MOST_G_L: Final = 2500.0
"""Of a solute in a litre: more than any common salt dissolves to (zinc iodide and caesium formate come near)."""

MOST_MOLAR: Final[Mapping[str, float]] = CONSTANTS["strongest"]
"""Acid or base -> mol/L of the strongest solution there is."""

MOST_DISSOLVED_MOLAR: Final[Mapping[str, float]] = CONSTANTS["dissolved"]
"""Gas or halogen -> mol/L that water dissolves at most under the air of a room."""

EDTA_PATTERN: Final = re.compile(r"EDTA|edta|(Na2H2|H4|Na4|H2)Y$")
"""Abbreviations of EDTA and its salts, in which Y would be yttrium."""

ROOM_C: Final = 25.0
"""Of a liquid whose temperature nobody states."""


@dataclass(frozen=True, eq=False)
class Contents:
    """Initial contents of a vessel: millilitres, and formula -> mol dissolved and solid."""

    volume_ml: float
    amounts: Mapping[str, float]
    solids: Mapping[str, float]
    solubility: Mapping[str, Mapping[float, float]]  # solid -> degC -> g in 100 g of water, as declared


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
    """Initial contents of a vessel by the scene.

    A solution has as much water as the room of its solutes leaves, unless the scene gives ``water_molar``.

    Raises EffectError: a formula or a number that cannot be.
    """
    liquid, litres = vessel.contents("liquid"), vessel.volume_ml * 1e-3
    concentrations: dict[str, float] = {}
    solutes = _solutes(vessel, liquid)
    for text, molar in solutes.items():
        formula = _formula(vessel, text)
        if formula in concentrations:
            raise vessel.fail(f"holds {formula!r} twice; give one concentration")
        _check_strength(vessel, formula, molar)
        concentrations[formula] = molar
    _check_dissolved(vessel, concentrations)
    amounts = {formula: litres * molar for formula, molar in concentrations.items()}
    if litres > 0.0:
        amounts[WATER] = litres * _water_molar(vessel, concentrations)
    solids: dict[str, float] = {}
    declared_solids: dict[str, Mapping[float, float]] = {}
    solid = vessel.contents("solid")
    if solid:
        formula = _formula(vessel, str(solid.get("formula")))
        solids[formula] = vessel.amount("solid", "mass_g") / molar_mass(formula)
        if "solubility_g_100g" in solid:
            declared_solids[formula] = _solubility(vessel, formula, solid["solubility_g_100g"])
    return Contents(vessel.volume_ml, amounts, solids, declared_solids)


def _water_molar(vessel: Vessel, concentrations: Mapping[str, float]) -> float:
    """mol of water in a litre of a solution, as declared, else by its solutes and its temperature."""
    if "water_molar" in vessel.contents("liquid"):
        return vessel.amount("liquid", "water_molar")
    try:
        return water_molar(concentrations) * expansion(vessel.celsius(REFERENCE_C))
    except KeyError as error:
        (formula,) = error.args
        raise vessel.fail(
            f"holds {concentrations[formula]:g} mol/L of {formula!r}, and no table knows how much room that takes: "
            "give liquid.water_molar, the mol of water in a litre of the solution"
        ) from error


def _solubility(vessel: Vessel, formula: str, value: Any) -> Mapping[float, float]:
    try:
        table = solubility_of(formula, value)
    except ValueError as error:
        raise vessel.fail(f"has solid.solubility_g_100g = {error}") from error
    assert table is not None
    return table


def _check_strength(vessel: Vessel, formula: str, molar: float) -> None:
    """Raises EffectError: no solution is as strong as a liquid that a vessel holds."""
    if formula in MOST_MOLAR:
        if molar > MOST_MOLAR[formula]:
            most_molar = number(MOST_MOLAR[formula])
            raise vessel.fail(f"holds {molar:g} mol/L of {formula!r}; the strongest solution of it has {most_molar}")
        return
    _check_saturated(vessel, formula, molar)
    grams = molar * molar_mass(formula)
    if grams > MOST_G_L:
        raise vessel.fail(
            f"holds {molar:g} mol/L of {formula!r}, which is {number(grams)} g in a litre: no solution is so strong; "
            "give molar in mol/L"
        )


def _check_saturated(vessel: Vessel, formula: str, molar: float) -> None:
    """Raises EffectError: a liquid holds more of a salt than dissolves at its temperature."""
    solubility_table = solubility_of(formula)
    if solubility_table is None:
        return
    celsius = vessel.celsius(ROOM_C)
    grams = float(np.interp(celsius, list(solubility_table), list(solubility_table.values())))
    most_molar = molar_of_molal(anhydrous(formula), 10.0 * grams / molar_mass(anhydrous(formula)))
    if molar > most_molar:
        raise vessel.fail(
            f"holds {molar:g} mol/L of {formula!r}; a saturated solution holds {number(most_molar)} mol/L at "
            f"{celsius:g} "
            "degC: give what is beyond as properties.solid"
        )


def _check_dissolved(vessel: Vessel, concentrations: Mapping[str, float]) -> None:
    """Raises EffectError: a liquid holds more of a gas or halogen than water dissolves."""
    # Iodide takes up one iodine each, as triiodide.
    iodide = sum(molar * _iodide_atoms(formula) for formula, molar in concentrations.items())
    for formula, molar in concentrations.items():
        most_molar = MOST_DISSOLVED_MOLAR.get(formula, np.inf) + (iodide if formula == "I2" else 0.0)
        if molar > most_molar:
            advice = "; more dissolves beside iodide: add KI to the solutes" if formula == "I2" else ""
            raise vessel.fail(
                f"holds {molar:g} mol/L of {formula!r}; water dissolves {number(most_molar)} at most{advice}"
            )


def _iodide_atoms(formula: str) -> float:
    """Iodide ions of a formula; iodine itself has none, and iodate holds oxygen."""
    atom_counts = atoms(formula)
    return 0.0 if formula == "I2" or "O" in atom_counts else atom_counts.get("I", 0)


def _solutes(vessel: Vessel, liquid: Mapping[str, Any]) -> dict[str, float]:
    """Formula, as written -> mol/L."""
    solutes_table = liquid.get("solutes") or {}
    if not isinstance(solutes_table, Mapping):
        raise vessel.fail(f"has liquid.solutes = {solutes_table!r}; give a table: formula = mol/L")
    solutes = {str(key): vessel.amount("liquid", str(key), within=solutes_table) for key in solutes_table}
    solute = liquid.get("solute", "")
    if not isinstance(solute, str) or (liquid.get("molar") and not solute):
        raise vessel.fail(f"has liquid.solute = {solute!r}; give the formula of what liquid.molar is of")
    if solute in solutes:
        raise vessel.fail(f"holds {solute!r} twice; give one concentration")
    # Plain water may be named as its own solute.
    is_water = solute == WATER or solute.lower() == "water"
    if solute and not (is_water and "molar" not in liquid):
        solutes[solute] = vessel.amount("liquid", "molar")
    return solutes


def _formula(vessel: Vessel, written_formula: str) -> str:
    formula = ion_of(written_formula, _is_readable_formula)
    if EDTA_PATTERN.search(written_formula):
        raise vessel.fail(f"holds {written_formula!r}; write the disodium salt of EDTA as 'Na2C10H14N2O8.2H2O'")
    try:
        atoms(formula)
    except ValueError as error:
        water = "; a liquid without solutes is water" if written_formula.lower() == "water" else ""
        raise vessel.fail(f"holds something that cannot be read: {error}{water}") from error
    # AgNo3 would be silver and nobelium.
    likely_formula = next(
        (common for common in COMMON_FORMULAS if common.lower() == formula.lower() and common != formula), ""
    )
    if likely_formula:
        raise vessel.fail(f"holds {formula!r}; did you mean {likely_formula!r}?")
    return formula


def _is_readable_formula(formula: str) -> bool:
    """Whether a formula is one whose charges are known."""
    try:
        return components_of(formula) is not None
    except ValueError:
        return False
