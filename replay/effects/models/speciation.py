"""The mixture that a scene's chemistry makes: species, solids and gases with their constants and enthalpies."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray
from replay.effects.models.equilibrium import Mixture
from replay.effects.models.species import (
    ATMOSPHERE_PA,
    ENTHALPY,
    HENRY,
    HYDROLYSIS,
    PKW,
    WATER_KJ_MOL,
    Chemistry,
)  # fmt: skip

SOLID, GAS = "(s)", "(g)"
PROTON, WATER = "H+", "H2O"
LN_10: Final = float(np.log(10.0))


@dataclass(frozen=True, eq=False)
class Speciation:
    """A mixture in the columns of a ledger.

    Parameters
    ----------
    mixture : species and phases of its parts, which are columns.
    changes : for each phase what one mol of it takes from the columns, below 0, and gives, itself and water among them.
    joule : (s + p,) enthalpy of formation of a mol of each species and phase from the parts; NaN: no table knows it.
    """

    mixture: Mixture
    changes: tuple[Mapping[str, float], ...]
    joule: FloatArray


def speciation_of(
    chemistry: Chemistry, columns: Iterable[str], solids: Mapping[str, float], gases: Iterable[str]
) -> Speciation:
    """The mixture of these columns, with solids by their solubility product and gases that bubble."""
    there = dict.fromkeys(columns)
    phases = [
        (formula + SOLID, chemistry.dissolved(formula), float(np.log(ksp)) - _from_parts(chemistry, formula) * LN_10)
        for formula, ksp in solids.items()
    ]
    for formula in gases:
        part, protons, per_m3 = HENRY[formula]
        level = np.log(per_m3 * 1e-3 * ATMOSPHERE_PA) - _protonation(chemistry.pka[part], protons) * LN_10
        phases.append((formula + GAS, gas_parts(formula), float(level)))
    phases = [phase for phase in phases if all(part in there for part in phase[1] if part != WATER)]
    used = {part for _, changes, _ in phases for part in changes}
    parts = [PROTON] + [
        part for part in dict.fromkeys((*there, *sorted(used)))
        if part not in (PROTON, WATER) and (part in used or chemistry.pka.get(part) or part in HYDROLYSIS)
    ]  # fmt: skip
    rows: list[tuple[str, dict[str, int], float, float]] = [
        (PROTON, {PROTON: 1}, 0.0, 0.0),
        ("OH-", {PROTON: -1}, -PKW, ENTHALPY["OH-"][0] - WATER_KJ_MOL),
    ]
    for part in parts[1:]:
        known = ENTHALPY.get(part, ())
        for protons in range(len(chemistry.pka.get(part, ())) + 1):
            rise = 0.0 if protons == 0 else known[protons] - known[0] if protons < len(known) else np.nan
            rows.append((part, {part: 1, PROTON: protons}, _protonation(chemistry.pka.get(part, ()), protons), rise))
        rows += [(part, {part: many, PROTON: -many}, log, 0.0) for many, log in HYDROLYSIS.get(part, ())]
    mixture = Mixture(
        tuple(parts), tuple(row[0] for row in rows), _table([row[1] for row in rows], parts),
        np.array([row[2] for row in rows]) * LN_10, tuple(phase[0] for phase in phases),
        _table([phase[1] for phase in phases], parts), np.array([phase[2] for phase in phases], dtype=np.float64),
    )  # fmt: skip
    formed = tuple({**{part: -many for part, many in uses.items()}, name: 1.0} for name, uses, _ in phases)
    return Speciation(
        mixture, formed,
        np.array([1e3 * row[3] for row in rows] + [enthalpy_j(changes) for changes in formed], dtype=np.float64),
    )  # fmt: skip


def gas_parts(formula: str) -> Mapping[str, int]:
    """Parts in solution of a gas that bubbles."""
    part, protons, _ = HENRY[formula]
    return {part: 1, PROTON: protons} if part == formula else {part: 1, PROTON: protons, WATER: -1}


def enthalpy_j(changes: Mapping[str, float]) -> float:
    """Enthalpy in J of so many mol made and used; NaN where no table knows a column."""
    total = 0.0
    for column, many in changes.items():
        total += many * (WATER_KJ_MOL if column == WATER else ENTHALPY.get(column, (np.nan,))[0])
    return total * 1e3


def _from_parts(chemistry: Chemistry, formula: str) -> float:
    """log10 of the constant with which a solid's ions, as its solubility product counts them, come from its parts."""
    parts = chemistry.parts(formula) or {}
    protons = parts.get(PROTON, 0)
    if protons <= 0:
        return protons * PKW
    takers = {part: many for part, many in parts.items() if chemistry.pka.get(part)}
    return sum(many * _protonation(chemistry.pka[part], protons // many) for part, many in takers.items())


def _protonation(pka: Iterable[float], protons: int) -> float:
    """log10 of the constant with which so many protons are taken, the tightest first."""
    return float(sum(sorted(pka, reverse=True)[:protons]))


def _table(rows: Sequence[Mapping[str, int]], parts: list[str]) -> FloatArray:
    table = [[float(row.get(part, 0.0)) for part in parts] for row in rows]
    return np.array(table, dtype=np.float64).reshape(len(rows), len(parts))
