"""Colours of liquids as they are drawn: names and mixtures, with no claim about light."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

Rgba = tuple[int, int, int, int]

WATERY: Final[Rgba] = (120, 170, 220, 150)
"""A liquid that no effect gives a colour."""

COLOURS: Final[Mapping[str, Rgba]] = {
    "colourless": WATERY, "white": (245, 245, 245, 235), "black": (25, 25, 25, 235), "red": (215, 40, 40, 200),
    "orange": (240, 140, 30, 200), "yellow": (245, 215, 50, 200), "green": (50, 165, 80, 200),
    "blue": (40, 90, 215, 200), "violet": (140, 70, 190, 200), "pink": (235, 90, 165, 200),
    "brown": (130, 80, 40, 220),
}  # fmt: skip
"""Word -> red, green, blue, alpha; drawn, not measured."""


def blended(first: Rgba, second: Rgba, share: NDArray[np.float64]) -> NDArray[np.uint8]:
    """(n, 4) from the first colour (share 0) to the second (share 1)."""
    part = np.clip(share, 0.0, 1.0)[:, None]
    mixed = (1.0 - part) * np.array(first, dtype=np.float64) + part * np.array(second, dtype=np.float64)
    return np.round(mixed).astype(np.uint8)
