"""Heat of strong solutions: what their ions hold in enthalpy beyond a dilute solution.

The relative apparent molal enthalpy of a salt is known by its molality. Of several salts together each pair of ions
counts at the ionic strength of the whole, by its share of the charges (T. F. Young's rule).
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray, IntArray
from replay.effects.chemistry.components import BASES, METALS, PROTON, WATER, component_of, dissolved_components
from replay.effects.chemistry.enthalpy import CONSTANTS
from replay.effects.chemistry.formulas import charge_of
from replay.effects.chemistry.mixture import EARTH_METALS, Mixture

SALT_HEATS_KJ_MOL: Final[Mapping[str, Mapping[str, float]]] = CONSTANTS["heat_content"]
"""Cation and anion -> mol/kg of their salt -> kJ/mol."""

HYDROXIDE: Final = "OH-"

PROTONATED_NAMES: Final = {
    ("NH3", 1): "NH4+", ("CO3^2-", 1): "HCO3-", ("SO4^2-", 1): "HSO4-",
}  # fmt: skip
"""Component and protons -> ion of the table; others have no heat of their own."""

DILUTE_EQUIVALENTS, STRONG_EQUIVALENTS = 1.1, 2.0
"""mol/kg of charges up to which a heat is that of infinite dilution, as tables of schools give it, and from which the
whole difference counts; chosen by us."""

LAST_MOLALITY_FACTOR: Final = 1.25
"""Of the last molality of a table: up to this its last value holds."""

LEAST_FRACTION: Final = 0.1
"""Of the charges: pairs of less without a table are not told."""


@dataclass(frozen=True, eq=False)
class Pair:
    """A cation and an anion with the heat of their salt."""

    cation: int
    anion: int
    equivalents: float  # charges of one sign in a mol of the salt
    strength: float  # ionic strength of a mol in a kilogram
    molal: FloatArray
    joule: FloatArray


class HeatContent:
    """Heat of strong solutions of the ions of one mixture.

    Parameters
    ----------
    columns : name of a column of the ledger -> its index.
    mixture : what PHREEQC's species are made of; ``None``: protons and hydroxide are what the ledger counts.
    declared : formulas of salts whose heat the scene declares: their pairs count nothing.
    """

    def __init__(self, columns: Mapping[str, int], mixture: Mixture | None, declared: Collection[str] = ()) -> None:
        if mixture is None:
            dissolved = {name: column for name, column in columns.items() if _is_ion(name)}
            rows = [{name: 1.0} for name in dissolved]
            self._ion_columns: IntArray | None = np.array(list(dissolved.values()), dtype=np.int64)
        else:
            rows = [_ions_of_species(entry.makeup) for entry in mixture.species]
            self._ion_columns = None
        names = dict.fromkeys((PROTON, HYDROXIDE, *(name for row in rows for name in row)))
        self.ions = tuple(names)
        index_of = {name: index for index, name in enumerate(self.ions)}
        self._powers = np.zeros((len(rows), len(self.ions)))
        for row, counts in enumerate(rows):
            for name, many in counts.items():
                self._powers[row, index_of[name]] = many
        self._charges = np.array([float(_charge(name)) for name in self.ions])
        self._proton = index_of[PROTON], index_of[HYDROXIDE]
        declared_ions = [set(_ions_of_species(dissolved_components(formula))) for formula in declared]
        self.pairs: list[Pair] = []
        for key, values in SALT_HEATS_KJ_MOL.items():
            cation, anion = key.split()
            if {cation, anion} <= set(self.ions) and not any({cation, anion} <= ions for ions in declared_ions):
                self.pairs.append(
                    _ion_pair(index_of[cation], index_of[anion], _charge(cation), -_charge(anion), values)
                )
        self._is_declared = np.zeros((len(self.ions), len(self.ions)), dtype=np.bool_)
        for ions in declared_ions:
            indices = [index_of[name] for name in ions if name in index_of]
            self._is_declared[np.ix_(indices, indices)] = True

    def moles(self, amounts: FloatArray, species: FloatArray, proton: int) -> FloatArray:
        """Mol (n, ions) of rows of the ledger, by PHREEQC's species where it is asked."""
        if self._ion_columns is None:
            return species @ self._powers
        moles = amounts[:, self._ion_columns] @ self._powers
        moles[:, self._proton[0]] = np.maximum(0.0, amounts[:, proton])
        moles[:, self._proton[1]] = np.maximum(0.0, -amounts[:, proton])
        return moles

    def joule(self, moles: FloatArray, kilograms: FloatArray) -> FloatArray:
        """J (n,) that ions (n, ions) in so much water (n,) hold beyond a dilute solution."""
        charges, total_charge, strength, weight = self._strengths(moles, kilograms)
        joule = np.zeros(len(moles))
        for pair in self.pairs:
            fraction = charges[:, pair.cation] * charges[:, pair.anion] / total_charge
            joule += fraction / pair.equivalents * np.interp(strength / pair.strength, pair.molal, pair.joule)
        return joule * weight

    def unknown(self, moles: FloatArray, kilograms: FloatArray) -> tuple[FloatArray, list[str]]:
        """mol/kg (n,) of charges where the heat is not known, 0 where it is, and the ions (n,) of most of it."""
        charges, total_charge, strength, weight = self._strengths(moles, kilograms)
        cations = np.where(self._charges > 0.0, charges, 0.0)
        anions = np.where(self._charges < 0.0, charges, 0.0)
        unknown_fractions = (cations / total_charge[:, None])[:, :, None] * (anions / total_charge[:, None])[:, None, :]
        unknown_fractions[:, self._is_declared] = 0.0
        for pair in self.pairs:
            is_known_strength = strength / pair.strength <= LAST_MOLALITY_FACTOR * pair.molal[-1]
            unknown_fractions[:, pair.cation, pair.anion] *= ~is_known_strength
        worst = unknown_fractions.reshape(len(moles), -1).argmax(axis=1)
        pair_names = [
            f"{self.ions[row // len(self.ions)]} and {self.ions[row % len(self.ions)]}" for row in worst.tolist()
        ]
        is_strong = (unknown_fractions.sum(axis=(1, 2)) > LEAST_FRACTION) & (weight >= 1.0)
        return np.where(is_strong, total_charge / kilograms, 0.0), pair_names

    def _strengths(
        self, moles: FloatArray, kilograms: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Charges (n, ions) of ions, of one sign together (n,), ionic strength (n,) and weight (n,) of the heat."""
        charges = moles * np.abs(self._charges)
        positive_charge = charges[:, self._charges > 0.0].sum(axis=1)
        negative_charge = charges[:, self._charges < 0.0].sum(axis=1)
        total_charge = np.maximum(np.maximum(positive_charge, negative_charge), 1e-300)
        strength = 0.5 * (charges @ np.abs(self._charges)) / kilograms
        weight = (total_charge / kilograms - DILUTE_EQUIVALENTS) / (STRONG_EQUIVALENTS - DILUTE_EQUIVALENTS)
        return charges, total_charge, strength, np.clip(weight, 0.0, 1.0)


def _ion_pair(cation: int, anion: int, plus: int, minus: int, values: Mapping[str, float]) -> Pair:
    common_charge = np.lcm(plus, minus)
    many_cations, many_anions = common_charge // plus, common_charge // minus
    strength = 0.5 * (many_cations * plus**2 + many_anions * minus**2)
    molal = np.array([0.0, *(float(key) for key in values)])
    joule = 1e3 * np.array([0.0, *values.values()])
    return Pair(cation, anion, float(common_charge), float(strength), molal, joule)


def _is_ion(column: str) -> bool:
    """Whether a column of the ledger is a dissolved ion but protons."""
    try:
        return column not in (PROTON, WATER) and "(" not in column and " " not in column and charge_of(column) != 0
    except ValueError:
        return False


def _charge(ion: str) -> int:
    """Charge of an ion of ``_ions_of_species``: of one with protons that has no name, of the whole."""
    component, _, protons = ion.partition(" + ")
    return charge_of(component) + (int(protons.split()[0]) if protons else 0)


def _ions_of_species(makeup: Mapping[str, float]) -> dict[str, float]:
    """Ions of a species: a pair of ions is its ions, a complex its metal and its anions, a molecule nothing."""
    protons = round(makeup.get(PROTON, 0.0))
    solutes = {component: float(many) for component, many in makeup.items() if component not in (PROTON, WATER)}
    if not solutes:
        return {PROTON: float(protons)} if protons > 0 else {HYDROXIDE: float(-protons)} if protons < 0 else {}
    ions: dict[str, float] = {}
    for component, many in solutes.items():
        bound_protons = min(protons, _most_protons(component)) if component not in METALS else 0
        if bound_protons > 0:
            protons -= bound_protons
            name = PROTONATED_NAMES.get((component, bound_protons), f"{component} + {bound_protons} H+")
            if component_of(component).charge + bound_protons:
                ions[name] = many
        elif component_of(component).charge:
            ions[component] = many
    if protons < 0 and set(solutes) & EARTH_METALS:
        ions[HYDROXIDE] = float(-protons)
    if protons > 0:
        ions[PROTON] = ions.get(PROTON, 0.0) + protons
    return ions


def _most_protons(component: str) -> int:
    """Protons that a base or anion holds at most in water; a neutral base becomes an ion by one."""
    return 1 if component in BASES else max(0, -component_of(component).charge)
