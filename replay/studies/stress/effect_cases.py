"""Hard cases of the effects' models, which ask no detector: stiff mixtures, exact equivalence, a level at the rim.

The truth comes by other ways than the models': decimal arithmetic of 30 digits, symmetry, slices of a vessel.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from decimal import Decimal, localcontext
from itertools import pairwise, product
from math import acos, asinh, atan, log, nextafter, pi, tan
from typing import Any, Final

import numpy as np

from replay.effects.models.sliced import volume_kept
from replay.effects.models.speciation import ph_of
from replay.effects.models.species import Chemistry
from replay.effects.models.warming import cooled

EFFECTS: Final = "effects"
"""Who is asked, in place of a detector."""

Asked = Iterator[tuple[str, str]]
"""What was asked, and what is wrong with the answer; empty where nothing is."""

DIGITS: Final = 30
CLOSE: Final = 1e-9
"""Of pH, of a temperature in degrees, of a share of a vessel."""

NODES, WEIGHTS = np.polynomial.legendre.leggauss(100)

PKW: Final = 14.0
WEAK: Final[Mapping[str, Sequence[float]]] = {"CH3COOH": (4.75,), "H2S": (-3.0, 14.0), "H3PO4": (2.15, 7.2, 12.35)}
"""Acids and pKa, among them one, made up, whose protons are 17 powers of ten apart."""


def stiff_mixtures() -> Asked:
    """49: amounts and steps far apart: acids from 1e-12 to 10 mol/L and a base, heat that is gone in a nanosecond."""
    for (acid, steps), amount, base in product(WEAK.items(), (1e-12, 1e-7, 1e-3, 10.0), (0.0, 1e-12, 1e-3, 10.0)):
        said = _ph({acid: amount, "NaOH": base})
        yield f"{acid} {amount:g} and NaOH {base:g} mol/L", _off(said, _true_ph(steps, amount, base))
    for capacity, seconds in product((1e-9, 1.0, 1e9), (1e-9, 1.0, 1e9)):
        given: dict[str, Any] = {
            "seconds": seconds, "power_w": 5.0, "capacity": capacity, "loss": 0.25, "ambient": 20.0, "celsius": 90.0,
        }  # fmt: skip
        said = float(cooled(**given))
        with localcontext(prec=DIGITS):
            left = (-Decimal(seconds) / 4 / Decimal(capacity)).exp()
            true = float(40 + 50 * left)
        yield f"a body of {capacity:g} J/K after {seconds:g} s", _off(said, true)


def equivalence() -> Asked:
    """50: as much base as acid, exactly and by the next number that a computer has on either side."""
    for amount in (1e-9, 1e-3, 0.1, 1.0, 8.0):
        yield f"strong, {amount:g} mol/L", _off(_ph({"HCl": amount, "NaOH": amount}), PKW / 2)
        for base in (nextafter(amount, 0.0), nextafter(amount, 9.0), amount * 1.001):
            # Closed form: the root of [H+] - Kw / [H+] = acid - base.
            true = PKW / 2 + asinh((base - amount) * 10.0 ** (PKW / 2) / 2.0) / log(10.0)
            yield f"strong, {amount:g} mol/L, base {base!r}", _off(_ph({"HCl": amount, "NaOH": base}), true)
        for acid, steps in WEAK.items():
            for protons in range(1, len(steps) + 1):
                said, true = _ph({acid: amount, "NaOH": protons * amount}), _true_ph(steps, amount, protons * amount)
                yield f"{acid} {amount:g} mol/L at its {protons}. point", _off(said, true)


def level_at_the_rim() -> Asked:
    """51: a vessel brim-full, tilted by hairs, until its floor begins to dry, and to a right angle."""
    for radius, height in ((0.03, 0.1), (1.0, 1.0), (0.005, 0.2), (0.1, 0.01)):
        whole, dry = pi * radius**2 * height, atan(height / (2.0 * radius))
        where = f"{radius:g} m by {height:g} m"
        tilts: list[Any] = [0.0, 5e-324, 1e-16, 1e-9, 0.3 * dry, nextafter(dry, 0.0), dry, nextafter(dry, 2.0)]
        tilts += [0.5 * (dry + pi / 2), pi / 2 - 1e-6, nextafter(pi / 2, 0.0), pi / 2]
        kept = [float(volume_kept(tilt, radius, height)) / whole for tilt in tilts]
        for tilt, share in zip(tilts, kept, strict=True):
            yield f"{where} at {tilt!r}", _off(share, _in_slices(tilt, radius, height) / whole)
        rising = any(after > before for before, after in pairwise(kept))
        yield f"{where}, more tilt", "keeps more" if rising else ""


def _ph(concentrations: Mapping[str, float]) -> float:
    amounts = {formula: np.array([amount]) for formula, amount in concentrations.items()}
    return float(ph_of(Chemistry(acids=WEAK, pkw=PKW), amounts)[0])


def _off(said: float, true: float) -> str:
    return "" if abs(said - true) <= CLOSE else f"{said!r} for {true!r}"


def _true_ph(steps: Sequence[float], acid: float, base: float) -> float:
    """pH from the balance of charges, halved in decimals: its species one after the other, none left out."""
    with localcontext(prec=DIGITS):
        ten, low, high = Decimal(10), Decimal(-3), Decimal(18)
        water = ten ** -Decimal(PKW)
        constants = [ten ** -Decimal(step) for step in steps]
        for _ in range(45):
            middle = (low + high) / 2
            free = ten**-middle
            species = [Decimal(1)]
            for constant in constants:
                species.append(species[-1] * constant / free)
            given = sum((k * one for k, one in enumerate(species)), Decimal(0)) / sum(species, Decimal(0))
            charge = free - water / free + Decimal(base) - Decimal(acid) * given
            low, high = (middle, high) if charge > 0 else (low, middle)
        return float((low + high) / 2)


def _in_slices(tilt: float, radius: float, height: float) -> float:
    """Volume below a plane through the lip: upright columns over slices of the floor, summed by Gauss's rule."""
    if tilt >= pi / 2:
        return 0.0
    slope = tan(tilt)
    # Over x from the lip's side the level is height - slope (radius - x), and 0 where the floor is dry.
    dry = max(-radius, radius - height / slope) if slope > 0.0 else -radius
    # The angle in place of x: the chord ends in a root, which no polynomial follows.
    half = 0.5 * acos(dry / radius)
    angle = half + half * NODES
    x, chord = radius * np.cos(angle), 2.0 * radius * np.sin(angle)
    level = np.maximum(height - slope * (radius - x), 0.0)
    return half * float((WEIGHTS * level * chord * radius * np.sin(angle)).sum())


EFFECT_CASES: Final[dict[int, tuple[str, Callable[[], Asked]]]] = {
    49: ("stiff mixtures", stiff_mixtures),
    50: ("equivalence point", equivalence),
    51: ("level at the rim", level_at_the_rim),
}
"""Number of a case -> its name, and what asks it."""
