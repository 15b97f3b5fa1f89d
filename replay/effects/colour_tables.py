"""Colours of indicators, ions and solids, which effects of liquids and of solids read."""

import tomllib
from collections.abc import Mapping
from importlib import resources
from typing import Any, Final

from replay.effects.chemistry.components import (
    BASES,
    PROTON,
    components_of,
    dissolved_components,
    dry_components,
    solute_components,
)
from replay.effects.chemistry.formulas import charge_of, ion_of

_TABLES: Final[dict[str, dict[str, Any]]] = tomllib.loads(
    resources.files("replay.effects.chemistry").joinpath("indicators.toml").read_text(encoding="utf-8")
)
ION_COLOURS: Final[Mapping[str, tuple[str, float]]] = {name: tuple(row) for name, row in _TABLES["species"].items()}
"""Ion -> its colour, and the mol/L at which it is full."""

SOLID_COLOURS: Final[Mapping[str, str]] = {solid: colour for colour, row in _TABLES["solids"].items() for solid in row}
"""Solid -> its colour."""

INDICATORS: Final[Mapping[str, Mapping[str, Any]]] = {
    name: row for name, row in _TABLES.items() if name not in ("species", "solids")
}
"""Name -> its range and colours."""


def coloured_species(formula: str) -> str:
    """The species that a formula means: a salt's own ion of a known colour, ``MnO4-`` of ``KMnO4``, else itself.

    Raises ValueError: it cannot be read, or is a salt none of whose ions has a colour that a table knows.
    """
    species = ion_of(formula, lambda name: components_of(name) is not None)
    if species in ION_COLOURS:
        return species
    brought = dry_components(dissolved_components(species))
    fitting_ions = [ion for ion in ION_COLOURS if components_of(ion) and _remaining_ions(brought, ion) is not None]
    # The one of most ions: the complex, and not its metal alone.
    coloured_ion = max(fitting_ions, key=lambda ion: sum(_dry_solutes(ion).values()), default="")
    if charge_of(species):
        return coloured_ion if coloured_ion and brought == _dry_solutes(coloured_ion) else species
    solutes = solute_components(species)
    if coloured_ion or len(solutes) < 2:
        return coloured_ion or species
    ions = [name for name in solutes if charge_of(name)]
    raise ValueError(f"{formula!r} is a salt; name its ion that has the colour, {' or '.join(ions)}")


def _dry_solutes(ion: str) -> dict[str, float]:
    return dry_components(dissolved_components(ion))


def _remaining_ions(brought: Mapping[str, float], ion: str) -> dict[str, float] | None:
    """Ions of a formula without those of which it has a coloured one; ``None``: it does not bring that."""
    own = _dry_solutes(ion)
    count = min(brought.get(component, 0.0) // many for component, many in own.items())
    if count < 1.0:
        return None
    remaining = {component: many - count * own.get(component, 0.0) for component, many in brought.items()}
    ammonium = sum(many for component, many in remaining.items() if component in BASES)
    # Chromate is no part of potassium dichromate, whose protons would be left.
    return remaining if remaining.get(PROTON, 0.0) in (0.0, ammonium) else None
