"""Colours of indicators, ions and solids, which effects of liquids and of solids read."""

import tomllib
from collections.abc import Mapping
from importlib import resources
from typing import Any, Final

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
