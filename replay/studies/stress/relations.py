"""Five relations between questions that have one answer: nothing in them rounds, so no verdict may change.

Rounded rotations and translations are no such relation: they change the exact answer itself.
"""

import itertools
from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.random import Generator

from cdcore.numerics import FloatArray

Relation = Callable[[FloatArray, Generator], FloatArray]
"""Triangle pairs (n, 2, 3, 3) to as many that meet where they met."""


def swapped(pairs: FloatArray, _rng: Generator) -> FloatArray:
    """The other triangle first."""
    return pairs[:, ::-1]


def reordered(pairs: FloatArray, rng: Generator) -> FloatArray:
    """The corners of each triangle in a random order, so that windings are reversed too."""
    order = np.array(list(itertools.permutations(range(3))))
    first, second = (order[rng.integers(0, 6, len(pairs))] for _ in range(2))
    rows = np.arange(len(pairs))[:, None]
    return np.stack([pairs[rows, 0, first], pairs[rows, 1, second]], axis=1)


def turned(pairs: FloatArray, rng: Generator) -> FloatArray:
    """The axes permuted, each with a sign."""
    order = list(rng.permutation(3))
    signs: FloatArray = rng.choice([-1.0, 1.0], 3)
    return pairs[..., order] * signs


def scaled(pairs: FloatArray, rng: Generator) -> FloatArray:
    """Each pair times a power of two from 2^-10 to 2^10."""
    return pairs * 2.0 ** rng.integers(-10, 11, (len(pairs), 1, 1, 1))


def shifted(pairs: FloatArray, rng: Generator) -> FloatArray:
    """Each pair moved by multiples of 8, where that rounds no coordinate; elsewhere as it is."""
    moved = pairs + 8.0 * rng.integers(-4, 5, (len(pairs), 1, 1, 3))
    shift = moved - pairs
    exact = (moved - shift == pairs).all(axis=(1, 2, 3))
    exact &= (shift == shift[:, :1, :1]).all(axis=(1, 2, 3))
    return np.where(exact[:, None, None, None], moved, pairs)


RELATIONS: Final[dict[str, Relation]] = {
    "swap": swapped, "order": reordered, "axes": turned, "scale": scaled, "shift": shifted,
}  # fmt: skip
"""Name -> what makes the second question of the first."""
