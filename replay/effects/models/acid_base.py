"""pH by charge balance: the one root of a monotone function, found by bisection, finite at every concentration."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray
from replay.effects.models.species import Chemistry

LOWEST, HIGHEST = -3.0, 18.0
"""pH between which the balance always changes its sign below 1,000 mol/L."""

HALVINGS: Final = 60
"""21 pH units halved 60 times are below the spacing of doubles near 7."""


@dataclass(frozen=True)
class AcidBase(Chemistry):
    """Which formulas are acids and bases, and the pH that they give together."""

    pkw: float = 13.995  # of water

    def is_acid(self, formula: str) -> bool:
        """Whether it gives protons."""
        return "H+" in (self.parts(formula) or ())

    def is_base(self, formula: str) -> bool:
        """Whether it takes protons: it has hydroxide, an anion of a weak acid with room for one, or is a told base."""
        parts = self.parts(formula) or {}
        room = sum(many * len(self.pka.get(part, ())) for part, many in parts.items())
        return "OH-" in parts or room > parts.get("H+", 0) or self.molecule_base(formula) is not None

    def ph(self, concentrations: Mapping[str, FloatArray]) -> FloatArray:
        """pH (n,) of mol/L (n,) of each formula; others are spectators. Activities are taken as concentrations."""
        count = max((len(one) for one in concentrations.values()), default=0)
        # Protons brought less hydroxide: near equivalence their difference is what counts.
        brought = np.zeros(count)
        takers: list[tuple[tuple[float, ...], FloatArray]] = []
        for formula, amount in concentrations.items():
            base = self.molecule_base(formula)
            for part, many in (self.parts(formula) or {formula: 1}).items():
                brought += amount * many * ((part == "H+") - (part == "OH-"))
                steps = self.pka.get(part, ()) or (() if base is None or part in self.pka else (base,))
                if steps and not (part != formula and base is not None and part not in self.pka):
                    takers.append((tuple(steps), amount * many))
        if not takers:
            # Strong ones alone solve a quadratic; of its two forms the one that adds.
            half = 0.5 * brought
            root = np.hypot(half, 10.0 ** (-0.5 * self.pkw))
            acid = half >= 0.0
            return np.where(acid, -np.log10(root + np.abs(half)), self.pkw + np.log10(root + np.abs(half)))
        low, high = np.full(count, LOWEST), np.full(count, HIGHEST)
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            held = 10.0 ** (-middle) - 10.0 ** (middle - self.pkw)
            for steps, amount in takers:
                held += amount * _protons_held(middle, steps)
            acid = held < brought
            low, high = np.where(acid, low, middle), np.where(acid, middle, high)
        return np.asarray(0.5 * (low + high))


def _protons_held(ph: FloatArray, pka: Sequence[float]) -> FloatArray:
    """Mean number (n,) of protons on what takes them."""
    # Weights of the species relative to the largest, so that none overflows far from the pKa.
    rising = sorted(pka, reverse=True)
    logs = np.stack([np.zeros_like(ph), *(sum(rising[:step]) - step * ph for step in range(1, len(pka) + 1))])
    weights = 10.0 ** (logs - logs.max(axis=0))
    steps = np.arange(len(pka) + 1)[:, None]
    return np.asarray((steps * weights).sum(axis=0) / weights.sum(axis=0))
