"""Salts that dissolve well: up to their measured solubility, by temperature.

PHREEQC's activities do not reach their saturation. The product of a salt's ions, in mol per kg of water, is that of its
saturated solution: a common ion lowers what dissolves, and hydroxide makes place for itself in an acid.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from cdcore.numerics import FloatArray
from replay.effects.chemistry.components import PROTON, WATER, components_of, dissolved_components
from replay.effects.chemistry.enthalpy import CONSTANTS, enthalpy_j
from replay.effects.chemistry.formulas import crystal_water, molar_mass

SOLUBILITY_G_PER_100_G: Final[Mapping[str, Mapping[float, float]]] = {
    formula: {float(celsius): grams for celsius, grams in table.items()}
    for formula, table in CONSTANTS["solubility"].items()
}
"""Salt without crystal water -> degC -> g in 100 g of water."""

HALVINGS: Final = 60
"""Of the interval in which the dissolved amount lies: to the last digit."""

WATER_KG: Final = 0.0180153
"""Of a mol of water. Source: IUPAC 2021."""


@dataclass(frozen=True, eq=False)
class Salt:
    """A solid with its solubility."""

    formula: str
    components: Mapping[str, int]
    celsius: FloatArray
    molal: FloatArray  # mol/kg of water at saturation at these temperatures
    joule: float  # enthalpy of a mol of the solid above its components

    @property
    def column(self) -> str:
        """Its column in the ledger."""
        return f"{self.formula}(s)"

    @property
    def changes(self) -> Mapping[str, float]:
        """Changes of the columns by one mol of the solid: below 0 of its components, 1 of itself."""
        return {**{component: -float(many) for component, many in self.components.items()}, self.column: 1.0}

    def saturation(self, celsius: FloatArray) -> FloatArray:
        """mol/kg (n,) of water; beyond the measured temperatures that of the nearest."""
        return np.interp(celsius, self.celsius, self.molal)


def anhydrous(formula: str) -> str:
    """A formula without its crystal water."""
    return formula.split(".")[0] if crystal_water(formula) else formula


def solubility_of(formula: str, declared: Any = None) -> Mapping[float, float] | None:
    """degC -> g without crystal water in 100 g of water, as declared or by the table; ``None``: nobody knows it.

    Raises ValueError: what is declared is neither a number above 0 nor a table of such by temperature.
    """
    if declared is None:
        anhydrous_formula = anhydrous(formula)
        if anhydrous_formula in SOLUBILITY_G_PER_100_G:
            return SOLUBILITY_G_PER_100_G[anhydrous_formula]
        mine = components_of(anhydrous_formula)
        return next(
            (
                table
                for name, table in SOLUBILITY_G_PER_100_G.items()
                if mine is not None and components_of(name) == mine
            ),
            None,
        )
    table = declared if isinstance(declared, Mapping) else {25.0: declared}
    try:
        table_by_celsius = {float(celsius): float(grams) for celsius, grams in table.items()}
    except (TypeError, ValueError) as error:
        raise ValueError(f"{declared!r}; give g in 100 g of water, or a table by degC") from error
    if not table_by_celsius or not all(grams > 0.0 and np.isfinite(grams) for grams in table_by_celsius.values()):
        raise ValueError(f"{declared!r}; give g in 100 g of water above 0, or a table by degC")
    return dict(sorted(table_by_celsius.items()))


def salt_of(formula: str, table: Mapping[float, float], heat_j: float | None = None) -> Salt:
    """A salt of a solubility; ``heat_j``: declared enthalpy of dissolving one mol."""
    components = dict(dissolved_components(formula))
    celsius, grams = np.array(list(table)), np.array(list(table.values()))
    molal = grams * 10.0 / molar_mass(anhydrous(formula))
    column = f"{formula}(s)"
    changes = {**{component: -float(many) for component, many in components.items()}, column: 1.0}
    joule = enthalpy_j(changes) if heat_j is None else -heat_j
    return Salt(formula, components, celsius, molal, joule)


def saturation_fraction(salt: Salt, column: Mapping[str, int], amounts: FloatArray, celsius: FloatArray) -> FloatArray:
    """Mean mol/kg (n,) of a salt's ions, a share of that of its solution saturated in water, of rows (n, columns)."""
    ions_present = _ions_present(salt, column, amounts)
    dissolved = np.min([amount / many for many, amount in ions_present], axis=0)
    water = _solvent_mol(column, amounts) + _water_taken_up(salt, np.maximum(0.0, dissolved))
    kilograms = np.maximum(water * WATER_KG, 1e-300)
    with np.errstate(divide="ignore"):
        logs = [many * np.log(np.maximum(0.0, amount) / (many * kilograms)) for many, amount in ions_present]
    mean_molal = np.exp(np.sum(logs, axis=0) / sum(many for many, _ in ions_present))
    return np.asarray(mean_molal / salt.saturation(celsius))


def settled_solid(salt: Salt, column: Mapping[str, int], amounts: FloatArray, celsius: FloatArray) -> FloatArray:
    """Mol (n,) of a salt that is solid at saturation, of rows (n, columns) of a ledger in which all of it is dissolved.

    ``column``: name of a column -> its place.
    """
    water = _solvent_mol(column, amounts)
    bound = crystal_water(salt.formula)
    ions_present = _ions_present(salt, column, amounts)
    most = np.min([amount / many for many, amount in ions_present], axis=0)
    water = water + _water_taken_up(salt, most)
    saturated = salt.saturation(celsius)
    moles_per_ion = np.array([amount / many for many, amount in ions_present])
    counts = np.array([many for many, _ in ions_present])
    with np.errstate(divide="ignore"):
        beyond = counts @ np.log(moles_per_ion) > counts.sum() * np.log(
            np.maximum(saturated * water * WATER_KG, 1e-300)
        )
    # Less is dissolved with each mol of solid: below saturation nothing falls out.
    if not beyond.any():
        return np.zeros(len(amounts))
    count_of_ion = counts[:, None]
    amount_of_ion = np.array([amount for _, amount in ions_present])
    # Logarithms of the product of what is dissolved, each ion as a share of what saturation has of it.
    lower, upper = np.zeros(len(amounts)), np.maximum(most, 0.0)
    with np.errstate(divide="ignore"):
        for _ in range(HALVINGS):
            solid = 0.5 * (lower + upper)
            logs_left = count_of_ion * np.log((amount_of_ion - count_of_ion * solid) / count_of_ion)
            # Crystal water of what is solid dissolves nothing.
            free = np.maximum(saturated * (water - bound * solid) * WATER_KG, 1e-300)
            beyond = logs_left.sum(axis=0) > counts.sum() * np.log(free)
            lower, upper = np.where(beyond, solid, lower), np.where(beyond, upper, solid)
    settled = 0.5 * (lower + upper)
    return np.where(settled > 1e-12 * np.maximum(most, 0.0), settled, 0.0)


def _solvent_mol(column: Mapping[str, int], amounts: FloatArray) -> FloatArray:
    """Mol (n,) of water but hydroxide, which is counted as water less a proton and dissolves nothing."""
    return np.asarray(amounts[:, column[WATER]] + np.minimum(0.0, amounts[:, column[PROTON]]))


def _water_taken_up(salt: Salt, dissolved: FloatArray) -> FloatArray:
    """Mol (n,) of water of which so many mol of a salt made ions: tables of solubility count it as solvent.

    Dichromate is counted as chromate and protons, with the oxygen of a water; borax as boric acid and hydroxide, with
    seven waters beside its own.
    """
    water_brought = salt.components.get(WATER, 0) + min(0, salt.components.get(PROTON, 0))
    return np.asarray((crystal_water(salt.formula) - water_brought) * dissolved)


def _ions_present(salt: Salt, column: Mapping[str, int], amounts: FloatArray) -> list[tuple[int, FloatArray]]:
    """How many of each ion a salt has, and mol (n,) of that ion in rows (n, columns)."""
    ions = {component: many for component, many in salt.components.items() if component not in (PROTON, WATER)}
    ions_present = [(many, amounts[:, column[component]]) for component, many in ions.items()]
    hydroxide = max(0, -salt.components.get(PROTON, 0))
    if hydroxide:
        ions_present.append((hydroxide, np.maximum(0.0, -amounts[:, column[PROTON]])))
    return ions_present
