"""Settings of detectors: frozen dataclasses whose fields say what they may be, and are checked when they are made."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, fields
from reprlib import repr as short
from typing import Any, Final

import numpy as np

from cdcore.errors import InvalidSettingError

MOST_METRES: Final = 1e6
MOST_HERTZ: Final = 1e6
MOST_SECONDS: Final = 1e6
MOST_WORK: Final = 10**12
"""Bounds of lengths, rates, times and budgets: far above any that is meant, far below what overflows."""

ALLOWED: Final = "allowed"
"""Key of what a field may be, in its metadata."""


@dataclass(frozen=True)
class Allowed:
    """Allowed values of a setting: a test, and its description."""

    holds: Callable[[object], bool]
    expected: str


@dataclass(frozen=True, kw_only=True)
class CheckedSettings:
    """Settings whose fields are made by ``flag``, ``whole``, ``number`` and ``choice``.

    Raises InvalidSettingError for a value that its field does not allow; one sentence names it and what to give.
    """

    def __post_init__(self) -> None:
        check_settings(self)


def check_settings(settings: Any) -> None:
    """Refuse a value that its field does not allow.

    A dataclass from outside may leave its fields plain: then a ``bool``, an ``int`` and a ``float`` are asked for by
    type only.
    """
    for item in fields(settings):
        value = getattr(settings, item.name)
        if isinstance(value, np.generic):
            value = value.item()
            object.__setattr__(settings, item.name, value)
        allowed = item.metadata.get(ALLOWED) or PLAIN.get(
            item.type if isinstance(item.type, str) else item.type.__name__
        )
        if allowed is not None and not allowed.holds(value):
            raise InvalidSettingError(f"{item.name}={short(value)} is not allowed; give {allowed.expected}")


def flag(default: bool) -> Any:
    """A field that is true or false."""
    return _field(default, IS_FLAG)


def whole(default: int | None, least: int, most: int) -> Any:
    """A field that is a whole number within bounds."""
    expected = f"a whole number of {least} or more, at most {most}"
    return _field(default, Allowed(lambda value: _is_whole(value, least, most), expected))


def number(default: float | None, least: float, most: float, *, above: bool = False, unit: str = "") -> Any:
    """A field that is a number within bounds, ``above`` the least or from it on."""

    def holds(value: object) -> bool:
        return _is_number(value) and least <= value <= most and not (above and value == least)  # type: ignore[operator]

    bounds = f"above {least:g}, at most {most:g}" if above else f"from {least:g} to {most:g}"
    expected = f"{unit or 'a number'} {bounds}"
    return _field(default, Allowed(holds, expected))


def choice(default: Any, among: Iterable[Any]) -> Any:
    """A field that is one of some values."""
    known = tuple(among)
    allowed = Allowed(
        lambda value: isinstance(value, (str, int)) and value in known, f"one of: {', '.join(map(str, known))}"
    )
    return _field(default, allowed)


def text(default: str, expected: str) -> Any:
    """A field that is a text, which ``expected`` says in words."""
    return _field(default, Allowed(lambda value: isinstance(value, str), expected))


def _field(default: Any, allowed: Allowed) -> Any:
    """A field that may also be ``None`` where that is its default."""
    if default is None:
        number_or_word = allowed
        allowed = Allowed(
            lambda value: value is None or number_or_word.holds(value), f"{number_or_word.expected} or None"
        )
    return field(default=default, metadata={ALLOWED: allowed})


def _is_whole(value: object, least: int, most: int) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and least <= value <= most


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


IS_FLAG: Final = Allowed(lambda value: isinstance(value, bool), "true or false")
PLAIN: Final = {
    "bool": IS_FLAG,
    "int": Allowed(lambda value: _is_whole(value, -(2**63), 2**63 - 1), "a whole number"),
    "float": Allowed(lambda value: _is_number(value) and math.isfinite(value), "a finite number"),  # type: ignore[arg-type]
}
"""Type of a plain field -> what it may be."""


@dataclass(frozen=True, kw_only=True)
class ContainmentSettings(CheckedSettings):
    """``containment``: whether to ask, where surfaces do not meet, if one body is inside the other."""

    containment: bool = flag(True)


@dataclass(frozen=True, kw_only=True)
class RateSettings(CheckedSettings):
    """When a detector samples.

    ``rate_hz``: samples per second of session time; ``None``: every frame. ``sampling_offset_s``: seconds after the
    start of the session at which the first tick of that rate lies.
    """

    rate_hz: float | None = number(None, 0, MOST_HERTZ, above=True, unit="looks per second")
    sampling_offset_s: float = number(0.0, 0, MOST_SECONDS, unit="seconds")
