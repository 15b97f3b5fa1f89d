"""Enthalpies and free energies of formation at 25 degC, and what a reaction gives off by them."""

import tomllib
from collections.abc import Mapping
from importlib import resources
from typing import Any, Final

CONSTANTS: Final[dict[str, dict[str, Any]]] = tomllib.loads(
    resources.files(__package__).joinpath("constants.toml").read_text(encoding="utf-8")
)
ENTHALPY_KJ_MOL: Final[Mapping[str, float]] = CONSTANTS["enthalpy"]
"""Column -> kJ/mol."""
PROTONATED_KJ_MOL: Final[Mapping[str, list[float]]] = CONSTANTS["protonated"]
"""Column -> kJ/mol with 0, 1, ... protons."""
HYDROXIDE_KJ_MOL: Final = -229.99
"""Of OH-. Source: Wagman et al. 1982."""
FREE_ENERGY_KJ_MOL: Final[Mapping[str, float]] = CONSTANTS["free_energy"]
"""Column -> kJ/mol."""


def enthalpy_j(changes: Mapping[str, float]) -> float:
    """Enthalpy in J of so many mol made and used; NaN where no table knows a column."""
    return _summed_energy(changes, ENTHALPY_KJ_MOL)


def free_energy_j(changes: Mapping[str, float]) -> float:
    """Standard free energy in J of so many mol made and used; NaN where no table knows a column."""
    return _summed_energy(changes, FREE_ENERGY_KJ_MOL)


def _summed_energy(changes: Mapping[str, float], table: Mapping[str, float]) -> float:
    summed_energy = 0.0
    for column, many in changes.items():
        summed_energy += many * table.get(column, float("nan"))
    return summed_energy * 1e3
