"""Numbers of physical quantities as people read them: three significant digits, no exponent, the unit by size.

`replay.words` has the rules for everything else that a screen shows.
"""

from collections.abc import Sequence
from math import floor, isfinite, log10
from typing import Final

NOT_MEASURED: Final = "not measured"
"""Stands for a quantity that nobody measured, or that is no finite number."""

DIGITS: Final = 3
"""Significant digits of a measured quantity."""

MOST_DECIMALS: Final = 12
"""Decimals of the smallest number that is told from 0."""

LARGEST: Final = 1e12
"""Beyond it a number is said to be larger, and not written out."""

Scale = Sequence[tuple[float, str]]
"""Units from the smallest to the largest, each with its size."""

LENGTHS: Final[Scale] = ((1e-9, "nm"), (1e-6, "µm"), (1e-3, "mm"), (1.0, "m"), (1e3, "km"))
TIMES: Final[Scale] = ((1e-9, "ns"), (1e-6, "µs"), (1e-3, "ms"), (1.0, "s"))

SMALLEST_FRACTION: Final = 0.01
"""The next larger unit is taken from this share of it on: ``0.13 ms`` and ``0.041 mm``, but ``9 µm``."""


LONGEST_SECONDS, LONGEST_MINUTES = 600.0, 7200.0
"""Seconds up to which a duration is told in seconds, and in minutes; beyond them in hours."""


def number(value: float | None, digits: int = DIGITS) -> str:
    """Returns a number with so many significant digits, no exponent: ``0.0412``, ``18.2``, ``300``, ``12,346``."""
    if value is None or not isfinite(value):
        return NOT_MEASURED
    if value == 0.0:
        return "0"
    if abs(value) > LARGEST:
        return f"{'less than -' if value < 0.0 else 'more than '}{LARGEST:,.0f}"
    decimals = min(MOST_DECIMALS, max(0, digits - 1 - floor(log10(abs(value)))))
    text = f"{value:,.{decimals}f}"
    text = text.rstrip("0").rstrip(".") if decimals else text
    return "0" if text == "-0" else text


def length(metres: float | None) -> str:
    """Returns a length in the unit of its size: ``0.7 mm``, ``300 mm``, ``1.2 m``."""
    return in_unit_of_size(metres, LENGTHS)


def duration(seconds: float | None) -> str:
    """Returns how long something takes, in the unit of its size: ``0.13 ms``, ``120 ms``, ``60 s``, ``12 min``."""
    if seconds is None or not isfinite(seconds) or abs(seconds) < LONGEST_SECONDS:
        return in_unit_of_size(seconds, TIMES)
    if abs(seconds) < LONGEST_MINUTES:
        return f"{number(seconds / 60)} min"
    return f"{number(seconds / 3600)} h"


def in_unit_of_size(value: float | None, units: Scale) -> str:
    """Returns a value in the largest unit of which it is a hundredth at least; from 1 on for the larger two."""
    if value is None or not isfinite(value):
        return NOT_MEASURED
    size, name = units[0]
    if value == 0.0:
        size, name = next(entry for entry in units if entry[1] in ("mm", "s"))
    for larger, larger_name in units[1:]:
        least = SMALLEST_FRACTION if larger_name in ("mm", "ms") else 1.0
        # Rounding comes first: 999.9 mm would be told as 1000 mm.
        if _rounded_value(abs(value) / larger) >= least:
            size, name = larger, larger_name
    return f"{number(value / size)} {name}"


def _rounded_value(value: float) -> float:
    """The value to as many significant digits as are printed."""
    return value if value == 0.0 else round(value, DIGITS - 1 - floor(log10(abs(value))))
