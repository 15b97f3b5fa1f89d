"""Everything in a vessel at equilibrium at once: acids, bases, metal ions, solids and gases, by one Newton iteration.

Gibbs energy is convex: it has one least value, whatever the order of the tables. Activities are taken as
concentrations, water as pure, 25 degC.

Source: White, Johnson and Dantzig, Chemical equilibrium in complex mixtures, J. Chem. Phys. 28 (1958) 751; the barrier
that keeps solids above nothing: Boyd and Vandenberghe, Convex Optimization, 2004, chapter 11.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cdcore.numerics import BoolArray, FloatArray

MOST_STEPS: Final = 400
"""Newton steps; 8 to 40 are usual."""

LEAST_BARRIER: Final = 1e-30
"""Of the barrier, as a share of what could form: where it ends, far below the rounding of any amount."""

GONE: Final = 1e-14
"""A solid that would bind less than this share of its scarcest part is none: the barrier's trace."""

ROUNDING: Final = 1e-12
"""Of a sum of logarithms."""

LONGEST: Final = 10.0
"""Change of a potential in one step: four powers of ten of a concentration."""

SETTLED: Final = 1e-7
"""Change of a logarithm in one step after which a species is at rest: the next step would change its square."""


@dataclass(frozen=True, eq=False)
class Mixture:
    """Which species, solids and gases may be made of which parts.

    Parameters
    ----------
    parts : names of the m parts; the first is ``H+``, whose total may be negative: hydroxide is water less a proton.
    species : names of the dissolved species.
    powers : (s, m) how many of each part are in a species.
    constants : (s,) natural logarithm of its formation constant, mol/L.
    phases : names of solids and gases.
    uses : (p, m) how many of each part are in a phase.
    products : (p,) natural logarithm of the product of parts, in mol/L, at which it is in equilibrium.
    """

    parts: tuple[str, ...]
    species: tuple[str, ...]
    powers: FloatArray
    constants: FloatArray
    phases: tuple[str, ...]
    uses: FloatArray
    products: FloatArray


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """What there is: ``species`` (n, s) and ``phases`` (n, p) in mol, and ``ph`` (n,)."""

    species: FloatArray
    phases: FloatArray
    ph: FloatArray


def equilibrium(mixture: Mixture, totals: FloatArray, litres: FloatArray) -> Equilibrium:
    """Amounts at equilibrium of mixtures in rows.

    ``totals`` : (n, m) mol of each part, dissolved and in solids together; below 0 only the first, ``H+``.
    ``litres`` : (n,) of the solution, above 0.

    A species is followed by the logarithm of its own amount, so that one part in 1e30 has all its digits.
    Cost: 8 to 40 steps, each a linear system of m + p unknowns a row.
    """
    count = len(totals)
    species = np.zeros((count, len(mixture.species)))
    phases = np.zeros((count, len(mixture.phases)))
    ph = np.zeros(count)
    # A part of which there is nothing makes nothing; what holds it is left out.
    there = totals > 0.0
    there[:, 0] = True
    for pattern in np.unique(there, axis=0):
        rows = np.flatnonzero((there == pattern).all(axis=1))
        dissolved = np.flatnonzero(~(mixture.powers[:, ~pattern] != 0.0).any(axis=1))
        possible = np.flatnonzero(~(mixture.uses[:, ~pattern] != 0.0).any(axis=1))
        parts = np.flatnonzero(pattern)
        solution = _Newton(
            mixture.powers[np.ix_(dissolved, parts)], mixture.constants[dissolved],
            mixture.uses[np.ix_(possible, parts)], mixture.products[possible],
        )  # fmt: skip
        amounts, formed, proton = solution.solve(totals[np.ix_(rows, parts)], litres[rows])
        species[np.ix_(rows, dissolved)] = amounts
        phases[np.ix_(rows, possible)] = formed
        ph[rows] = proton
    return Equilibrium(species, phases, ph)


@dataclass(frozen=True, eq=False)
class _Newton:
    """The iteration for mixtures that have the same parts."""

    powers: FloatArray
    constants: FloatArray
    uses: FloatArray
    products: FloatArray

    def solve(self, totals: FloatArray, litres: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Species (n, s), phases (n, p) in mol and pH (n,)."""
        state = self._start(totals, litres)
        done = [np.zeros_like(one) for one in state]
        rows = np.arange(len(totals))
        for _ in range(MOST_STEPS):
            state, settled = self._step(state, totals[rows], litres[rows])
            for kept, now in zip(done, state, strict=True):
                kept[rows] = now
            if settled.all():
                break
            state = tuple(one[~settled] for one in state)
            rows = rows[~settled]
        logs, potentials, formed, *_ = done
        trace = formed <= GONE * _scarcest(totals, self.uses)
        return np.exp(logs), np.where(trace, 0.0, formed), -potentials[:, 0] / np.log(10.0)

    def _start(self, totals: FloatArray, litres: FloatArray) -> tuple[FloatArray, ...]:
        """Logarithms of species, potentials of parts, phases, their distance from saturation, and the barrier."""
        size = np.abs(totals).sum(axis=1) + 1e-6 * litres
        free = np.where(totals > 0.0, totals, size[:, None])
        free[:, 0] = 1e-7 * litres + 0.1 * np.abs(totals[:, 0])
        potentials = np.log(free / litres[:, None])
        potentials[:, 0] = np.where(totals[:, 0] > 0.0, potentials[:, 0], np.log(1e-14) - potentials[:, 0])
        most = np.minimum(_scarcest(free, self.powers), size[:, None])
        formed = np.minimum(_scarcest(totals, self.uses), size[:, None]) * 0.1 / max(1, len(self.uses))
        return np.log(0.1 * most), potentials, formed, np.ones_like(formed), formed.copy()

    def _step(
        self, state: tuple[FloatArray, ...], totals: FloatArray, litres: FloatArray
    ) -> tuple[tuple[FloatArray, ...], BoolArray]:
        logs, potentials, formed, slack, barrier = state
        parts, phases = self.powers.shape[1], len(self.uses)
        amounts = np.exp(logs)
        away = self.constants + potentials @ self.powers.T + np.log(litres)[:, None] - logs
        size = np.abs(totals).sum(axis=1)[:, None] + 1e-6 * litres[:, None]
        matrix = np.zeros((len(totals), parts + phases, parts + phases))
        wanted = np.zeros((len(totals), parts + phases, 1))
        # Not reduced to the parts alone: with an ion at 1e-20 of the others that matrix would be singular to rounding.
        matrix[:, :parts, :parts] = (amounts[:, None, :] * self.powers.T) @ self.powers
        matrix[:, :parts, parts:] = self.uses.T * size[:, None]
        matrix[:, parts:, :parts] = self.uses
        diagonal = range(parts, parts + phases)
        matrix[:, diagonal, diagonal] = -slack / formed * size
        missing = totals - amounts @ self.powers - formed @ self.uses
        wanted[:, :parts, 0] = missing - (amounts * away) @ self.powers
        wanted[:, parts:, 0] = self.products - potentials @ self.uses.T - barrier / formed
        weight = np.abs(matrix).max(axis=2, keepdims=True)
        change = np.linalg.solve(matrix / weight, wanted / weight)[..., 0]
        turned, grown = change[:, :parts], change[:, parts:] * size
        factor = away + turned @ self.powers.T
        closer = self.products - (potentials + turned) @ self.uses.T - slack
        # A distance below the rounding of potentials limits no step.
        nearer = np.where(slack > ROUNDING, -closer / slack, 0.0)
        fall = np.concatenate([-grown / formed, nearer], axis=1)
        share = np.minimum(1.0, 0.99 / np.maximum(fall.max(axis=1, initial=0.0), 1e-300))[:, None]
        share = np.minimum(share, LONGEST / np.maximum(np.abs(turned).max(axis=1), LONGEST)[:, None])
        # What is scarce follows its parts at once; what could exceed them rises by its amount, which keeps the sums.
        step = share * factor
        limit = np.maximum(np.log1p(np.maximum(step, 0.0)), np.log(0.1 * size) - logs)
        logs = logs + np.minimum(step, limit)
        potentials = potentials + share * turned
        formed = formed + share * grown
        slack = np.maximum(slack + share * closer, 0.01 * barrier / formed)
        most = np.minimum(_scarcest(totals, self.uses), size)
        least = LEAST_BARRIER * most
        real = formed > GONE * most
        relative = np.where(real, np.abs(grown / np.where(real, formed, 1.0)), 0.0)
        moved = np.abs(factor).max(axis=1) + relative.max(axis=1, initial=0.0)
        settled = (moved < SETTLED) & (barrier <= least).all(axis=1)
        barrier = np.where(share > 0.5, np.maximum(0.01 * barrier, least), barrier)
        return (logs, potentials, formed, slack, barrier), settled


def _scarcest(amounts: FloatArray, table: FloatArray) -> FloatArray:
    """Mol (n, k) of what parts make by a table (k, m) until the scarcest of amounts (n, m), protons aside, is out."""
    bound = table[:, 1:] > 0.0
    share = np.where(bound, amounts[:, None, 1:] / np.where(bound, table[:, 1:], 1.0), np.inf)
    return share.min(axis=2, initial=np.inf)
