"""Kinds of end points of a titration."""

from enum import StrEnum


class Equivalence(StrEnum):
    """Reagents that are equivalent at an end point, by kind."""

    ACID_AND_BASE = "acid and base"
    OXIDANT_AND_REDUCTANT = "oxidant and reductant"
    METAL_AND_ANION = "metal and anion"
