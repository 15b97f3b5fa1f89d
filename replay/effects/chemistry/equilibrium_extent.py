"""How far an equation without a constant in PHREEQC goes: to the equilibrium that its free energy sets.

PHREEQC keeps oxidation states apart, so the constant of a redox equation is taken from free energies of formation, and
PHREEQC gives the activities. What would leave less than a thousandth of its scarcest reagent runs to its end.
"""

from collections.abc import Callable, Mapping, Sequence
from math import log
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray, IntArray
from replay.effects.chemistry.components import PROTON, WATER
from replay.effects.chemistry.iodine import IODIDE, IODINE, free_iodine
from replay.effects.chemistry.mixture import GAS, SOLID
from replay.effects.chemistry.processes import Process
from replay.effects.chemistry.salts import WATER_KG
from replay.effects.chemistry.solver import Solver

COMPLETE_REMAINDER_FRACTION: Final = 1e-3
"""Of the scarcest reagent: an equation that leaves less at equilibrium runs to its end."""

CERTAIN_DECADES: Final = 3.0
"""Powers of ten by which concentrations, taken for activities, must be on the side of the products to ask no more."""

LEAST_EXTENT_FRACTION: Final = 1e-6
LAST_STEP: Final = 1e-5
"""Of the way from all products to all reagents: where the search begins, and its last step.

Steps shrink like their squares: after one so small 1e-7 is left.
"""

MOST_TRIALS: Final = 60
COARSE_STEP: Final = 8
"""Rows of which one is searched for without a neighbour."""

LEAST_SLOPE: Final = 0.1
"""Of a secant; a quotient that rises ten times slower or quicker than by concentrations is no good guide."""

HALVINGS: Final = 40
"""Of the way, for a fraction to the last digits."""

NEUTRAL_PROTONS_MOLAR: Final = 1e-7
TINY: Final = 1e-30
GAS_J_MOL_K: Final = 8.314463
"""Gas constant. Source: CODATA 2018."""
KELVIN_25_C: Final = 298.15

Excess = Callable[[FloatArray, IntArray], FloatArray]
"""log10 of a quotient by its constant (n,), of fractions of the way (n,) and rows (n,)."""


class EquilibriumExtents:
    """Equilibria of the processes of a ledger.

    Parameters
    ----------
    processes, changes : (p, columns) what a mol of each makes.
    column : name of a column of the ledger -> its place.
    solver : PHREEQC; ``None``: concentrations are taken for activities.
    holds_acid : (columns,) protons that each column holds in neutral water.
    """

    def __init__(
        self,
        processes: Sequence[Process],
        changes: FloatArray,
        column: Mapping[str, int],
        solver: Solver | None,
        holds_acid: FloatArray,
    ) -> None:
        self._processes, self._changes, self._column, self._solver = processes, changes, column, solver
        self._holds_acid = holds_acid
        self._proton, self._water = column[PROTON], column[WATER]
        if solver is not None:
            mixture = solver.mixture
            self._components = np.array([column[name] for name in mixture.components], dtype=np.int64)
            self._solids = np.array(
                [column[phase.column] for phase in mixture.phases if not phase.column.endswith(GAS)], dtype=np.int64
            )
            self._formation = np.zeros((len(self._solids), len(column)))
            made = [changed for changed in mixture.changes if not any(name.endswith(GAS) for name in changed)]
            for row, changed in enumerate(made):
                for name, many in changed.items():
                    self._formation[row, column[name]] = many
        self._known = [self._has_constant(process) for process in processes]

    def known(self, row: int) -> bool:
        """Whether a process has a constant, and its ions activities."""
        return self._known[row]

    def extent(self, row: int, amounts: FloatArray, most_extent: FloatArray, celsius: FloatArray) -> FloatArray:
        """Mol (n,) of a process until it is at equilibrium, at most ``most_extent`` (n,), below 0 where it runs back.

        What leaves as a gas does not come back, and what has a rate does not run back.
        """
        extents = most_extent.copy()
        lowest = -self._products(row, amounts)
        lowest = np.where(most_extent - lowest > 0.0, lowest, 0.0)
        extent_range = most_extent - lowest
        log_k = self._log_k(row, celsius)
        candidates = (extent_range > 0.0) & (amounts[:, self._water] > 0.0)
        nearly_all = lowest + extent_range * (1.0 - COMPLETE_REMAINDER_FRACTION)
        ideal_quotient = self._ideal_quotient(row, amounts + nearly_all[:, None] * self._changes[row])
        candidates &= ideal_quotient > log_k - CERTAIN_DECADES
        candidate_rows = np.flatnonzero(candidates)
        if not len(candidate_rows):
            return extents

        def trial_amounts(fraction: FloatArray, rows: IntArray) -> FloatArray:
            return np.asarray(
                amounts[rows] + (lowest[rows] + extent_range[rows] * fraction)[:, None] * self._changes[row]
            )

        def ideal_excess(fraction: FloatArray, rows: IntArray) -> FloatArray:
            """log10 of the quotient by the constant, rising with the extent, with concentrations for activities."""
            return self._ideal_quotient(row, trial_amounts(fraction, rows)) - log_k[rows]

        def excess(fraction: FloatArray, rows: IntArray) -> FloatArray:
            return self._quotient(row, trial_amounts(fraction, rows), celsius[rows]) - log_k[rows]

        fractions = _fractions_at_equilibrium(excess, ideal_excess, candidate_rows)
        stopping_rows = candidate_rows[fractions < 1.0]
        stopping_fractions = fractions[fractions < 1.0]
        extents[stopping_rows] = lowest[stopping_rows] + extent_range[stopping_rows] * stopping_fractions
        return extents

    def _has_constant(self, process: Process) -> bool:
        if not np.isfinite(process.log_k):
            return False
        if process.is_ester or self._solver is None:
            return True
        mixture = self._solver.mixture
        bare = dict(zip(mixture.components, mixture.bare_names, strict=True))
        return all(bare.get(name, "") is not None for name in process.changes)

    def _products(self, row: int, amounts: FloatArray) -> FloatArray:
        """Mol (n,) by which a process can run back."""
        process, changes = self._processes[row], self._changes[row]
        product_indices = [
            index for name, index in self._column.items() if changes[index] > 0.0 and name not in (PROTON, WATER)
        ]
        if process.rate is not None or not product_indices or any(name.endswith(GAS) for name in process.changes):
            return np.zeros(len(amounts))
        return np.maximum(0.0, np.min([amounts[:, index] / changes[index] for index in product_indices], axis=0))

    def _log_k(self, row: int, celsius: FloatArray) -> FloatArray:
        """log10 of the constant (n,) at temperatures, by the enthalpy of the process where it is known."""
        process = self._processes[row]
        joule = process.joule if np.isfinite(process.joule) and not process.is_ester else 0.0
        return process.log_k - joule / (GAS_J_MOL_K * log(10.0)) * (1.0 / (celsius + 273.15) - 1.0 / KELVIN_25_C)

    def _ideal_quotient(self, row: int, amounts: FloatArray) -> FloatArray:
        """log10 of the quotient (n,) by concentrations, and the protons that no weak acid holds."""
        process = self._processes[row]
        if process.is_ester:
            return self._ester_quotient(row, amounts)
        kilograms = np.maximum(amounts[:, self._water] * WATER_KG, TINY)
        free_protons = np.maximum(
            NEUTRAL_PROTONS_MOLAR, (amounts[:, self._proton] - amounts @ self._holds_acid) / kilograms
        )
        log_quotient = np.zeros(len(amounts))
        for name, many in process.changes.items():
            if name == PROTON:
                log_quotient += many * np.log10(free_protons)
            elif name != WATER and not name.endswith((SOLID, GAS)):
                log_quotient += many * np.log10(np.maximum(amounts[:, self._column[name]] / kilograms, TINY))
        return log_quotient

    def _quotient(self, row: int, amounts: FloatArray, celsius: FloatArray) -> FloatArray:
        """log10 of the quotient (n,) by PHREEQC's activities; below any constant where it has no answer."""
        process = self._processes[row]
        if process.is_ester or self._solver is None:
            return self._ideal_quotient(row, amounts)
        total_amounts = amounts - amounts[:, self._solids] @ self._formation
        water = total_amounts[:, self._water]
        equilibria = self._solver.equilibrium(total_amounts[:, self._components], water, celsius)
        kilograms = np.maximum(water * WATER_KG, TINY)
        components = self._solver.mixture.components
        free_iodine_molal = free_iodine(self._column, total_amounts, kilograms)
        log_quotient = np.zeros(len(amounts))
        for name, many in process.changes.items():
            if name == PROTON:
                log_quotient -= many * equilibria.ph
            elif name in components:
                activity = equilibria.log_activity[:, components.index(name)]
                if name == IODIDE:
                    iodide_molal = np.maximum(total_amounts[:, self._column[IODIDE]] / kilograms, TINY)
                    activity = activity + np.log10(np.maximum(free_iodine_molal[IODIDE], TINY) / iodide_molal)
                log_quotient += many * activity
            elif name != WATER and not name.endswith((SOLID, GAS)):
                molal = (
                    free_iodine_molal[IODINE] if name == IODINE else total_amounts[:, self._column[name]] / kilograms
                )
                log_quotient += many * np.log10(np.maximum(molal, TINY))
        return np.where(np.isnan(log_quotient), -np.inf, log_quotient)

    def _ester_quotient(self, row: int, amounts: FloatArray) -> FloatArray:
        """log10 of ester and water by acid and alcohol (n,), all in mol: water is one of the products."""
        free_protons = amounts[:, self._proton] - amounts @ self._holds_acid
        log_quotient = np.zeros(len(amounts))
        for name, many in self._processes[row].changes.items():
            moles = amounts[:, self._column[name]]
            if name == PROTON:
                continue
            if name.endswith("-"):
                moles = np.minimum(moles, free_protons)
            log_quotient += many * np.log10(np.maximum(moles, TINY))
        return log_quotient


def _fractions_at_equilibrium(excess: Excess, ideal_excess: Excess, rows: IntArray) -> FloatArray:
    """Fractions (n,) of the way at which ``excess`` is 0: 1 if it is below 0 to the end, 0 if never.

    Rows follow each other in time. Every `COARSE_STEP`-th comes first, and the others begin between their neighbours.
    """
    coarse = np.unique(np.append(np.arange(0, len(rows), COARSE_STEP), len(rows) - 1))
    fractions, ideal, slope = _roots(excess, ideal_excess, rows[coarse], np.zeros(len(coarse)), np.ones(len(coarse)))
    if len(coarse) == len(rows):
        return fractions
    every_row, others = np.arange(len(rows)), np.setdiff1d(np.arange(len(rows)), coarse)
    start, start_slope = (np.interp(others, every_row[coarse], values) for values in (ideal, slope))
    all_fractions = np.zeros(len(rows))
    all_fractions[coarse] = fractions
    all_fractions[others] = _roots(excess, ideal_excess, rows[others], start, start_slope)[0]
    return all_fractions


def _roots(
    excess: Excess, ideal_excess: Excess, rows: IntArray, target: FloatArray, slope: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Fractions (n,) as above, and there ``ideal_excess`` and the slope of ``excess`` over it.

    By secants over ``ideal_excess``, which is quick to compute, rises along the way, and differs from ``excess`` by the
    activities alone. ``target``, ``slope``: of it where they begin.
    """
    count = len(rows)
    begin, end = np.full(count, LEAST_EXTENT_FRACTION), np.full(count, 1.0 - COMPLETE_REMAINDER_FRACTION)
    lower, upper = begin.copy(), end.copy()
    ideal, value = np.full(count, np.nan), np.full(count, np.nan)
    target, slope = target.copy(), slope.copy()
    fractions = _inverse(ideal_excess, rows, lower, upper, target)
    active = np.arange(count)
    for _ in range(MOST_TRIALS):
        trial, at = fractions[active], rows[active]
        trial_value, trial_ideal = excess(trial, at), ideal_excess(trial, at)
        is_below = trial_value < 0.0
        lower[active], upper[active] = (
            np.where(is_below, trial, lower[active]),
            np.where(is_below, upper[active], trial),
        )
        with np.errstate(invalid="ignore", divide="ignore"):
            secant = (trial_value - value[active]) / (trial_ideal - ideal[active])
            is_usable = (secant > LEAST_SLOPE) & (secant < 1.0 / LEAST_SLOPE)
            slope[active] = np.where(is_usable, secant, slope[active])
            proposal = trial_ideal - trial_value / slope[active]
        ideal[active], value[active] = trial_ideal, trial_value
        ideal_lower, ideal_upper = ideal_excess(lower[active], at), ideal_excess(upper[active], at)
        is_inside = (proposal > ideal_lower) & (proposal < ideal_upper)
        target[active] = np.where(is_inside, proposal, 0.5 * (ideal_lower + ideal_upper))
        following = _inverse(ideal_excess, at, lower[active], upper[active], target[active])
        # An end that was not looked at yet comes before halving what is left.
        goes_to_end = (proposal >= ideal_upper) & (upper[active] == end[active])
        goes_to_begin = (proposal <= ideal_lower) & (lower[active] == begin[active])
        following = np.where(goes_to_end, end[active], np.where(goes_to_begin, begin[active], following))
        is_complete = is_below & (trial == end[active])
        is_nothing = ~is_below & (trial == begin[active])
        is_near = (np.abs(following - trial) <= LAST_STEP) & ~goes_to_end & ~goes_to_begin
        is_ended = is_complete | is_nothing | is_near
        fractions[active] = np.where(is_complete, 1.0, np.where(is_nothing, 0.0, following))
        active = active[~is_ended]
        if not len(active):
            break
    return fractions, target, slope


def _inverse(
    ideal_excess: Excess, rows: IntArray, lower: FloatArray, upper: FloatArray, target: FloatArray
) -> FloatArray:
    """Fractions (n,) between two at which ``ideal_excess`` has a value; the nearer end where it has not."""
    below, above = lower.copy(), upper.copy()
    for _ in range(HALVINGS):
        middle = 0.5 * (below + above)
        is_beyond = ideal_excess(middle, rows) > target
        below, above = np.where(is_beyond, below, middle), np.where(is_beyond, middle, above)
    return 0.5 * (below + above)
