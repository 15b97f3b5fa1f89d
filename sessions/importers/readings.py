"""Stamps, numbers and texts of a decoded message, whoever decoded it; what is missing is NaN or ""."""

import math
from collections.abc import Iterable
from typing import Any


def number(value: Any) -> float:
    """A number as float64; NaN where it is none."""
    fits = isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300
    return float(value) if fits else math.nan


def numbers_of(value: Any, names: Iterable[str]) -> list[float]:
    """Some attributes as numbers."""
    return [number(getattr(value, name, None)) for name in names]


def text(value: Any) -> str:
    """A text; "" where it is none."""
    return value if isinstance(value, str) else ""


def listed(value: Any) -> list[Any]:
    """The entries of a list; none where it is no list."""
    return [] if isinstance(value, str) or not hasattr(value, "__len__") else list(value)


def part(value: Any, path: str) -> Any:
    """The attribute that dots lead to; ``None`` where it is absent."""
    for name in path.split("."):
        value = getattr(value, name, None)
    return value


def stamp_of(time: Any) -> int:
    """Nanoseconds of a timestamp of protobuf, JSON or ROS; 0 where it is absent."""
    parts = []
    for names in (("seconds", "sec"), ("nanos", "nsec", "nanosec")):
        values = (getattr(time, name, None) for name in names)
        parts.append(next((value for value in values if type(value) is int), 0))
    return parts[0] * 1_000_000_000 + parts[1]
