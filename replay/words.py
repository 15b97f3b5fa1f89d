"""Numbers as people read them: lengths, times, shares, counts, ranges, rates and dates, each by one rule.

A measured quantity has three significant digits, no exponent, and the unit that suits its size; zeros at the end of a
fraction are left out: ``0.7 mm``, ``18.2 mm``, ``300 mm``, ``1.2 m``; ``0.13 ms``, ``120 ms``. Every screen calls these
functions, so that a number is the same wherever it stands.
"""

from collections.abc import Mapping, Sequence
from datetime import datetime
from math import ceil, floor, log10
from typing import Final

from sessions.quantities import DIGITS, MOST_DECIMALS, NOT_MEASURED
from sessions.quantities import duration as duration
from sessions.quantities import length as length
from sessions.quantities import number as number

FRAME_TIME_DIGITS: Final = 2
"""Significant digits of what a detector takes for a frame: the third one differs from run to run."""


def number_above(value: float, limit: float) -> str:
    """A number greater than a limit, with as many digits as that takes to be seen: ``11.14`` above 11.1."""
    for digits in range(DIGITS, MOST_DECIMALS):
        if round(value, digits - 1 - floor(log10(abs(value)))) > limit:
            return number(value, digits)
    return number(value, MOST_DECIMALS)


def quantity(value: float | None, unit: str) -> str:
    """A number with its unit, where that is the same at any size: ``24.9 mL``, ``62.5 degC``."""
    text = number(value)
    return text if text == NOT_MEASURED else f"{text} {unit}"


def instrument_reading(value: float, unit: str, decimals: int) -> str:
    """Reading of an instrument with so many decimals: ``24.85 mL`` of a burette, ``7.00`` of a pH meter."""
    return f"{value:.{decimals}f} {unit}".rstrip()


def millimetres(metres: float | None) -> str:
    """The number alone, in millimetres, for a column or an axis whose head names the unit."""
    return number(None if metres is None else 1e3 * metres)


def milliseconds(seconds: float | None) -> str:
    """The number of a ``frame_time`` alone, for a column or an axis whose head names the unit: ``0.041``, ``120``."""
    return number(None if seconds is None else 1e3 * seconds, FRAME_TIME_DIGITS)


def frame_time(seconds: float | None) -> str:
    """Time of a detector for a frame, always in milliseconds so that two can be compared: ``0.041 ms``."""
    return NOT_MEASURED if seconds is None else f"{milliseconds(seconds)} ms"


def moment(seconds: float) -> str:
    """A moment on the clock of a session, to the millisecond so that frames up to 1,000 Hz differ: ``20.700 s``."""
    return f"{timestamp(seconds)} s"


def decimal(value: float, decimals: int, *, signed: bool = False) -> str:
    """A number with so many decimals, for a unit that follows: ``18.2``, ``+0.35``."""
    return f"{value:{'+' if signed else ''}.{decimals}f}"


def timestamp(seconds: float | None) -> str:
    """A moment on the clock of a session to the millisecond, the number alone: ``20.700``; ``""``: there is none."""
    return "" if seconds is None else f"{seconds:.3f}"


def time_span(start: float | None, end: float | None) -> str:
    """Seconds from start to end, one number where they are the same, nothing where they are unknown."""
    if start is None or end is None:
        return ""
    return timestamp(start) if start == end else f"{timestamp(start)} to {timestamp(end)}"


def rate(hertz: float) -> str:
    """A rate: ``50 Hz``, ``22.5 Hz``."""
    return quantity(hertz, "Hz")


def percentage(percent: float) -> str:
    """The number of a percentage, with two digits of its distance from 0 or 100, whichever is nearer.

    ``2.6``, ``50``, ``99.98``: of what is nearly all, the digits that tell are those of what is missing.
    """
    nearer = min(percent, 100.0 - percent)
    decimals = max(0, 1 - floor(log10(nearer))) if nearer > 0.0 else 0
    text = f"{percent:.{decimals}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def as_percentage(fraction: float | None) -> str:
    """A share of a whole: ``86 %``, ``0.4 %``, ``99.98 %``."""
    return NOT_MEASURED if fraction is None else f"{percentage(100 * fraction)} %"


def interval(lower: float, upper: float) -> str:
    """An interval of a share: ``16 to 100 %``, ``0.2 to 1.5 %``, as coarse as its width allows, rounded outwards."""
    lower_percent, upper_percent = 100 * lower, 100 * upper
    decimals = max(0, 1 - floor(log10(upper_percent - lower_percent))) if upper_percent > lower_percent else 1
    step = 10**decimals
    return f"{number(floor(lower_percent * step) / step, 4)} to {number(ceil(upper_percent * step) / step, 4)} %"


def loss_number(loss: float) -> str:
    """A loss as ``replay.auditing.loss`` defines it, with two digits: ``0.94``, ``0.0031``, ``2.1``."""
    return number(loss, digits=2)


def ratio(value: float) -> str:
    """One quantity as a multiple of another: ``x 1.25``."""
    return f"x {number(value)}"


def count_range(counts: tuple[int, int]) -> str:
    """``0-1``: smallest to largest; one number where they are equal."""
    smallest, largest = counts
    return f"{smallest:,}" if smallest == largest else f"{smallest:,}-{largest:,}"


def count_words(counts: tuple[int, int]) -> str:
    """Smallest to largest inside a sentence: ``up to 1``, ``1 to 3``; one number where they are equal."""
    smallest, largest = counts
    if smallest == largest:
        return f"{smallest:,}"
    return f"{smallest:,} to {largest:,}" if smallest else f"up to {largest:,}"


def mean_count(mean: float) -> str:
    """A mean of counts, which need not be whole: ``0.5``, ``1.25``, ``12``."""
    return number(mean)


def date(when: datetime) -> str:
    """A day and a time of day: ``2026-11-27 19:54``."""
    return f"{when:%Y-%m-%d %H:%M}"


def safe_text(text: str, *, lines: bool = False) -> str:
    """The text, with control characters, marks of direction and other invisible ones written as in Python: ``\\x1b``.

    ``lines``: line ends stay.
    """
    checked_text = text.replace("\n", "") if lines else text
    if checked_text.isprintable():
        return text
    return "".join(
        character if _plain(character) or (lines and character == "\n") else repr(character)[1:-1] for character in text
    )


def drawable(text: str) -> str:
    """The same for matplotlib, which takes what stands between two dollars for mathematics."""
    return safe_text(text).replace("$", r"\$")


def _plain(letter: str) -> bool:
    # Spaces of any width are not printable for Python.
    return letter.isprintable() or (letter.isspace() and letter > "\x9f" and letter not in "\u2028\u2029")


def plural(number: int, thing: str, several: str = "") -> str:
    """``1 frame``, ``2 frames``; ``several`` where an s is not enough."""
    return f"{number:,} {thing if number == 1 else several or thing + 's'}"


def joined_names(names: Sequence[str], conjunction: str = "and") -> str:
    """``a``, ``a and b``, ``a, b and c``."""
    *leading_names, last_name = names
    return f"{', '.join(leading_names)} {conjunction} {last_name}" if leading_names else last_name


def tally_text(counts: Mapping[str, int]) -> str:
    """Names and how often each: ``contact: 18, breakage: 1``. The name of an event is no word that has a plural."""
    return ", ".join(f"{name}: {count:,}" for name, count in counts.items())
