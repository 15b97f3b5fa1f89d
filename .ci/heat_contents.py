"""Heat of strong solutions of one salt by published parameters, beside the table [heat_content] of the chemistry.

    python .ci/heat_contents.py

prints every row of the table with the values that the parameters in `heat_contents.toml` give: Pitzer's equation, the
extended UNIQUAC model of K. Thomsen, or an integral heat of solution, whichever is nearest to the row's value.
"""

import tomllib
from pathlib import Path

import numpy as np

from replay.effects.chemistry.formulas import charge_of
from replay.effects.chemistry.heat_content import SALT_HEATS_KJ_MOL

PARAMETERS = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
GAS = 8.314462618
KELVIN = 298.15
DEBYE_J = 1986.0
"""A of the enthalpy at 25 degC, J kg^0.5 mol^-1.5. Source: K. S. Pitzer, Activity Coefficients, 1991."""

WATER_MOL = 55.508
"""In a kilogram."""

STEP_K = 0.5
"""Half of the difference of temperature that gives an enthalpy."""

DILUTE = 1e-9
"""mol/kg that stand for infinite dilution."""

ENOUGH_KJ = 0.02
"""Difference within which a row is printed again: its values have two decimals."""


def pitzer(pair, molal):
    """kJ/mol that a salt holds beyond infinite dilution by Pitzer's equation; nothing without parameters."""
    if pair not in PARAMETERS["pitzer"]:
        return None
    first, second, third = PARAMETERS["pitzer"][pair]
    cation, anion = pair.split()
    plus, minus = charge_of(cation), -charge_of(anion)
    cations, anions = _counts(("H2O", cation, anion))
    root = np.sqrt(0.5 * molal * (cations * plus**2 + anions * minus**2))
    decay = 2.0 * root
    middle = first + second * 2.0 * (1.0 - (1.0 + decay) * np.exp(-decay)) / decay**2
    triple = cations * plus * third / (2.0 * np.sqrt(plus * minus))
    debye = (cations + anions) * plus * minus * DEBYE_J / 2.4 * np.log1p(1.2 * root)
    return (debye - 2.0 * cations * anions * GAS * KELVIN**2 * (molal * middle + molal**2 * triple)) / 1e3


def joined(pair, molal):
    """The same by Pitzer's equation to its last molality, and by the change of the UNIQUAC model beyond."""
    last = PARAMETERS["joined"].get(pair)
    if last is None or molal <= last:
        return None
    return pitzer(pair, last) + uniquac(pair, molal) - uniquac(pair, last)


def uniquac(pair, molal):
    """The same by the extended UNIQUAC model; nothing where an ion has no size."""
    names = ("H2O", *pair.split())
    if not set(names) <= PARAMETERS["uniquac"]["size"].keys():
        return None
    return _uniquac_enthalpy(names, molal) - _uniquac_enthalpy(names, DILUTE)


def _uniquac_enthalpy(names, molal):
    """kJ of the excess of a mol of salt in its water, by the change of the excess free energy with temperature."""
    counts = _counts(names)
    moles = np.array([WATER_MOL, *(count * molal for count in counts)])
    warmer, cooler = (_excess(names, moles, KELVIN + sign * STEP_K) for sign in (1.0, -1.0))
    return -GAS * KELVIN**2 * (warmer - cooler) / (2.0 * STEP_K) / molal / 1e3


def _counts(names):
    """Cations and anions in a mol of salt."""
    plus, minus = charge_of(names[1]), -charge_of(names[2])
    common = np.lcm(plus, minus)
    return common // plus, common // minus


def _excess(names, moles, kelvin):
    """Excess free energy by R T of mol of water, cation and anion."""
    sizes = np.array([PARAMETERS["uniquac"]["size"][name] for name in names])
    energy = np.array([[_energy(one, other, kelvin) for other in names] for one in names])
    psi = np.exp(-(energy - np.diag(energy)[None, :]) / kelvin)
    fractions = moles / moles.sum()
    volume, surface = (fractions * sizes[:, column] / (fractions @ sizes[:, column]) for column in (0, 1))
    combined = moles @ np.log(volume / fractions) - 5.0 * (moles * sizes[:, 1]) @ np.log(volume / surface)
    residual = -(moles * sizes[:, 1]) @ np.log(surface @ psi)
    celsius = kelvin - 273.15
    debye, size = 1.131 + 1.335e-3 * celsius + 1.164e-5 * celsius**2, 1.5
    charges = np.array([0.0, charge_of(names[1]), charge_of(names[2])])
    root = size * np.sqrt(0.5 * moles @ charges**2 * WATER_MOL / moles[0])
    electric = -moles[0] / WATER_MOL * 4.0 * debye / size**3 * (np.log1p(root) - root + root**2 / 2.0)
    return combined + residual + electric


def _energy(one, other, kelvin):
    pairs = PARAMETERS["uniquac"]["energy"]
    energy, change = pairs.get(f"{one} {other}", pairs.get(f"{other} {one}", (0.0, 0.0)))
    return energy + change * (kelvin - KELVIN)


def integral(pair, molal):
    """The same by integral heats of solution; nothing where none is of this molality."""
    heats = PARAMETERS["integral"].get(pair, {})
    near = [value for water, value in heats.items() if water != "much" and abs(WATER_MOL / int(water) - molal) < 0.1]
    return heats["much"] - near[0] if near else None


SOURCES = {"pitzer": pitzer, "joined": joined, "uniquac": uniquac, "integral": integral}


def nearest(pair, molal, stands):
    """Source and kJ/mol that come nearest to what stands in the table; nothing where no source has the pair."""
    values = {name: value for name, source in SOURCES.items() if (value := source(pair, molal)) is not None}
    return min(values.items(), key=lambda row: abs(row[1] - stands), default=None)


def rows():
    """Pair, molality, what stands in the table, and source and value of the nearest, but of heats that are 0.

    Those are of pairs whose heat PHREEQC has, or the table of diluted sulfuric acid.
    """
    for pair, values in SALT_HEATS_KJ_MOL.items():
        for molal, stands in values.items() if any(values.values()) else ():
            yield pair, float(molal), stands, nearest(pair, float(molal), stands)


if __name__ == "__main__":
    known, again = 0, 0
    for pair, molal, stands, found in rows():
        if found is None:
            print(f"{pair}, {molal:g} mol/kg: {stands}; no source here")
            continue
        source, value = found
        known, again = known + 1, again + (abs(value - stands) <= ENOUGH_KJ)
        print(f"{pair}, {molal:g} mol/kg: {stands}; {source} {value:.2f}")
    print(f"{again} of {known} values with a source are printed again within {ENOUGH_KJ} kJ/mol")
