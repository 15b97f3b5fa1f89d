"""Heats of what stands in vessels: enthalpy of the dissolved and of solids, and what keeps how much heat."""

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from cdcore.numerics import BoolArray, FloatArray
from replay.effects.chemistry.components import PROTON, WATER
from replay.effects.chemistry.heat_content import HeatContent
from replay.effects.chemistry.ledger_columns import ENTHALPY_COLUMN, HEAT_CAPACITY_COLUMN, Warmth
from replay.effects.chemistry.mixture import SOLID, Mixture
from replay.effects.chemistry.salts import WATER_KG, Salt
from replay.effects.chemistry.warming import WATER_J_PER_ML_K, heat_given_off, solid_j_per_mol_k

FIRST_J_PER_KG_K, WHOLE_J_PER_KG_K = 200.0, 1000.0
"""J/K of what is dissolved in a kg of water: below the first it adds nothing to the water's, from the second on all.

Within 6 % of the heat capacities of solutions of NaNO3, NH4NO3, NH4Cl, KNO3, CaCl2 and NaCl up to 10 mol/kg, of NaOH up
to 10, by M. Laliberte, J. Chem. Eng. Data 54, 2009. By handbook values, written without a copy at hand, 8 % too much
for CaCl2 of 20 % by mass (14 % with 4.18 J/K for every mL), 12 to 19 % for strong hydrochloric acid (25 to 47 %).
"""

WATER_J_PER_KG_K: Final = 1e3 * WATER_J_PER_ML_K


class Heats:
    """Enthalpies and heat capacities of rows of a ledger.

    Parameters
    ----------
    column : name of a column of the ledger -> its place.
    mixture : what PHREEQC's species are; ``None``: it is not asked.
    salts : solids that dissolve up to their solubility.
    warmth : how heat is followed.
    """

    def __init__(
        self, column: Mapping[str, int], mixture: Mixture | None, salts: Sequence[Salt], warmth: Warmth
    ) -> None:
        self._column, self._mixture, self._warmth = column, mixture, warmth
        self._salts = np.array([column[salt.column] for salt in salts], dtype=np.int64)
        self._salt_joule = np.array([salt.joule for salt in salts])
        phases = () if mixture is None else tuple(phase.column for phase in mixture.phases)
        self._phases = np.array([column[name] for name in phases], dtype=np.int64)
        solids = {name: index for name, index in column.items() if name.endswith(SOLID)} if warmth.followed else {}
        self._solids = np.array(list(solids.values()), dtype=np.int64)
        self._solid_capacity = np.array([solid_j_per_mol_k(name.removesuffix(SOLID)) for name in solids])
        self.content = HeatContent(column, mixture, warmth.declared) if warmth.followed else None

    def is_estimated(self, amounts: FloatArray) -> BoolArray:
        """Whether the heat capacity of rows (n, columns) is that of water and solutes, and the latter count."""
        _, dissolved = self.capacities(amounts)
        return (dissolved > 0.0) & (self._warmth.per_ml is None)

    def enthalpy(self, amounts: FloatArray) -> FloatArray:
        """J (n,) of what is dissolved, of solids and of gases that left, above the parts they are made of."""
        stored_joule = amounts[:, self._column[ENTHALPY_COLUMN]].copy()
        if self._warmth.followed:
            if self._mixture is not None:
                stored_joule += amounts[:, self._phases] @ self._mixture.joule[len(self._mixture.species) :]
            stored_joule += amounts[:, self._salts] @ self._salt_joule
        return stored_joule

    def dissolved_enthalpy(self, amounts: FloatArray, species: FloatArray) -> FloatArray:
        """J (n,) of what is dissolved; ``species``: mol (n, s) as PHREEQC has them, of none where it is not asked."""
        assert self.content is not None
        joule = np.zeros(len(amounts)) if self._mixture is None else species @ self._mixture.joule[: species.shape[1]]
        moles = self.content.moles(amounts, species, self._column[PROTON])
        joule += self.content.joule(moles, self.water_kg(amounts))
        if self._warmth.solute in self._column:
            acid, water = (amounts[:, self._column[name]] for name in (self._warmth.solute, WATER))
            joule -= heat_given_off(acid, water, self._warmth.dilution)
        return joule

    def water_kg(self, amounts: FloatArray) -> FloatArray:
        """Kilograms (n,) of water; what the ledger counts as water less a proton is hydroxide."""
        water = amounts[:, self._column[WATER]] + np.minimum(0.0, amounts[:, self._column[PROTON]])
        return np.maximum(water * WATER_KG, 1e-300)

    def liquid(self, volume_ml: FloatArray | float, amounts: FloatArray) -> FloatArray:
        """Heat capacity (...), J/K, of liquids but what is dissolved: as declared by volume, else of their water."""
        if self._warmth.per_ml is not None:
            return np.asarray(self._warmth.per_ml * volume_ml)
        kilograms = self.water_kg(np.atleast_2d(amounts)).reshape(amounts.shape[:-1])
        return np.asarray(WATER_J_PER_KG_K * np.where(np.asarray(volume_ml) > 0.0, kilograms, 0.0))

    def capacities(self, amounts: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Heat capacities (...), J/K, of what was brought beside water: of what is still solid, and of what dissolved.

        A solid that falls out of a solution keeps no heat of its own: the volume of its solution counts already.
        """
        amount_rows = np.atleast_2d(amounts)
        brought_capacity = amount_rows[:, self._column[HEAT_CAPACITY_COLUMN]]
        solid = np.minimum(amount_rows[:, self._solids] @ self._solid_capacity, brought_capacity)
        per_kg = (brought_capacity - solid) / self.water_kg(amount_rows)
        counted_fraction = np.clip((per_kg - FIRST_J_PER_KG_K) / (WHOLE_J_PER_KG_K - FIRST_J_PER_KG_K), 0.0, 1.0)
        shape = amounts.shape[:-1]
        return solid.reshape(shape), ((brought_capacity - solid) * counted_fraction).reshape(shape)
