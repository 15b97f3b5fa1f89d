"""A balanced equation as written on a blackboard, and how far it goes: to the end of the limiting reagent."""

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from cdcore.numerics import FloatArray

_TERM = re.compile(r"^(\d+)?\s*([A-Z][A-Za-z0-9().]*)$")
_PART = re.compile(r"([A-Z][a-z]?|\(|\))(\d*)")


@dataclass(frozen=True)
class Equation:
    """``2 A + B -> C``."""

    # reagents, products: formula -> coefficient
    reagents: Mapping[str, int]
    products: Mapping[str, int]

    def extent(self, amounts: Mapping[str, FloatArray]) -> FloatArray:
        """Mol of reaction (n,) at the end of the limiting reagent, from mol (n,) of each reagent."""
        shares = [amounts[formula] / coefficient for formula, coefficient in self.reagents.items()]
        return np.asarray(np.maximum(0.0, np.min(shares, axis=0)))


def equation_of(text: str) -> Equation:
    """Read an equation. Raises ValueError: it cannot be read, or its two sides do not have the same atoms."""
    left, arrow, right = text.partition("->")
    if not arrow:
        raise ValueError(f"{text!r} has no ->; write it as HCl + NaOH -> NaCl + H2O")
    equation = Equation(_side(left), _side(right))
    before, after = (_atoms_of(side) for side in (equation.reagents, equation.products))
    if before != after:
        wrong = sorted(atom for atom in {*before, *after} if before[atom] != after[atom])
        counted = ", ".join(f"{atom} {before[atom]} and {after[atom]}" for atom in wrong)
        raise ValueError(f"{text!r} is not balanced: {counted}; correct its coefficients")
    return equation


def atoms(formula: str) -> Counter[str]:
    """Atoms of a formula such as ``Ca(OH)2`` or ``CuSO4.5H2O``. Raises ValueError: it is no formula."""
    total: Counter[str] = Counter()
    for part in formula.split("."):
        factor = re.match(r"\d*", part)
        assert factor is not None
        for atom, count in _group(part[factor.end() :], formula).items():
            total[atom] += count * int(factor.group() or 1)
    return total


def approach(times: FloatArray, goal: FloatArray, rate: float) -> FloatArray:
    """First-order approach (n,) to a goal that is constant from each time to the next: dx/dt = rate (goal - x), x >= 0.

    Closed form from row to row, so that rows may be as far apart as they like.
    """
    reached = np.zeros(len(times))
    for row in range(1, len(times)):
        # 1 - exp(-rate dt) by expm1: for short steps the difference would lose its digits.
        share = -np.expm1(-rate * (times[row] - times[row - 1]))
        reached[row] = reached[row - 1] + share * max(0.0, goal[row - 1] - reached[row - 1])
    return reached


def _side(text: str) -> dict[str, int]:
    found: Counter[str] = Counter()
    for term in text.split("+"):
        match = _TERM.match(term.strip())
        if match is None:
            raise ValueError(f"{term.strip()!r} is no formula with its coefficient; write for example 2 HCl")
        atoms(match.group(2))
        found[match.group(2)] += int(match.group(1) or 1)
    if min(found.values()) < 1:
        raise ValueError(f"{text.strip()!r} has a coefficient 0; leave it out")
    return dict(found)


def _atoms_of(side: Mapping[str, int]) -> Counter[str]:
    total: Counter[str] = Counter()
    for formula, coefficient in side.items():
        for atom, count in atoms(formula).items():
            total[atom] += coefficient * count
    return total


def _group(text: str, whole: str) -> Counter[str]:
    stack: list[Counter[str]] = [Counter()]
    place = 0
    while place < len(text):
        match = _PART.match(text, place)
        if match is None:
            raise ValueError(f"{whole!r} is no formula; write for example Ca(OH)2 or CuSO4.5H2O")
        word, count = match.group(1), int(match.group(2) or 1)
        place = match.end()
        if word == "(":
            stack.append(Counter())
        elif word == ")" and len(stack) > 1:
            for atom, inner in stack.pop().items():
                stack[-1][atom] += inner * count
        elif word != ")":
            stack[-1][word] += count
        else:
            raise ValueError(f"{whole!r} closes a bracket that it does not open; correct the formula")
    if len(stack) > 1 or not stack[0]:
        raise ValueError(f"{whole!r} is no formula: a bracket is left open or it is empty")
    return stack[0]
