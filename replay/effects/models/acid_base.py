"""pH by charge balance: the one root of a monotone function, found by bisection, finite at every concentration."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray

STRONG_ACIDS: Final[Mapping[str, int]] = {"HCl": 1, "HBr": 1, "HI": 1, "HNO3": 1, "HClO4": 1}
"""Formula -> protons given off completely in water. Source: the six strong acids of general chemistry without H2SO4,
whose second step is weak: declare it with its pKa."""

STRONG_BASES: Final[Mapping[str, int]] = {
    "LiOH": 1, "NaOH": 1, "KOH": 1, "RbOH": 1, "CsOH": 1, "Sr(OH)2": 2, "Ba(OH)2": 2,
}  # fmt: skip
"""Formula -> hydroxide ions, completely dissociated. Source: alkali and soluble alkaline earth hydroxides."""

LOWEST, HIGHEST = -3.0, 18.0
"""pH between which the balance always changes its sign below 1,000 mol/L."""

HALVINGS: Final = 60
"""21 pH units halved 60 times are below the spacing of doubles near 7."""


@dataclass(frozen=True)
class AcidBase:
    """Which formulas are acids and bases."""

    acids: Mapping[str, Sequence[float]] = field(default_factory=dict)  # weak acid -> its pKa, one per proton, rising
    bases: Mapping[str, float] = field(default_factory=dict)  # weak base -> pKa of its conjugate acid
    pkw: float = 13.995  # of water

    def is_acid(self, formula: str) -> bool:
        """Whether it gives protons."""
        return formula in self.acids or formula in STRONG_ACIDS

    def is_base(self, formula: str) -> bool:
        """Whether it takes protons."""
        return formula in self.bases or formula in STRONG_BASES

    def ph(self, concentrations: Mapping[str, FloatArray]) -> FloatArray:
        """pH (n,) of mol/L (n,) of each formula; others are spectators. Activities are taken as concentrations."""
        count = max((len(one) for one in concentrations.values()), default=0)
        low, high = np.full(count, LOWEST), np.full(count, HIGHEST)
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            acid = self._charge(middle, concentrations) > 0.0
            low, high = np.where(acid, middle, low), np.where(acid, high, middle)
        return np.asarray(0.5 * (low + high))

    def _charge(self, ph: FloatArray, concentrations: Mapping[str, FloatArray]) -> FloatArray:
        """Positive less negative charge, mol/L, that a pH would mean: it falls as pH rises, and is 0 at the true one.

        Free protons and hydroxide, cations of strong bases, protonated weak bases, anions of acids.
        """
        charge = 10.0 ** (-ph) - 10.0 ** (ph - self.pkw)
        strong = np.zeros_like(ph)
        for formula, amount in concentrations.items():
            if formula in self.acids:
                charge -= amount * _protons_given(ph, self.acids[formula])
            elif formula in self.bases:
                charge += amount / (1.0 + 10.0 ** (ph - self.bases[formula]))
            else:
                # Strong ones are summed among themselves first: near equivalence their difference is what counts.
                strong += amount * (STRONG_BASES.get(formula, 0) - STRONG_ACIDS.get(formula, 0))
        return np.asarray(charge + strong)


def _protons_given(ph: FloatArray, pka: Sequence[float]) -> FloatArray:
    """Mean number (n,) of protons that a molecule has given off."""
    # Weights of the species relative to the largest, so that none overflows far from the pKa.
    logs = np.stack([np.zeros_like(ph), *(step * ph - sum(pka[:step]) for step in range(1, len(pka) + 1))])
    weights = 10.0 ** (logs - logs.max(axis=0))
    steps = np.arange(len(pka) + 1)[:, None]
    return np.asarray((steps * weights).sum(axis=0) / weights.sum(axis=0))
