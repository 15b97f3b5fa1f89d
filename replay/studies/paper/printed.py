"""Figures printed in the paper, from ``printed.toml``."""

import tomllib
from importlib.resources import files
from typing import Any, Final

PRINTED_LABEL: Final = "paper"
"""Heading of every column that holds a value of the paper."""

ABOUT_PRINTED: Final = "paper: as printed there; its hardware, budget and counting of faces are unknown."
"""Stands once below the tables that have such a column."""

PRINTED_FIGURES: Final[dict[str, dict[str, Any]]] = tomllib.loads(
    files("replay.studies.paper").joinpath("printed.toml").read_text("utf-8")
)
"""Row here -> what is printed of it."""


def printed_figure(row_name: str, figure_name: str) -> float | None:
    """Printed figure of a row; ``None``: the paper prints none."""
    value: float | None = PRINTED_FIGURES.get(row_name, {}).get(figure_name)
    return value
