"""Random numbers that depend on the seed, the two bodies and the stamp, and on nothing else.

A search draws them in its kernel: asked of numpy, they took a quarter of a live look (2026-11), 8 microseconds for a
stream and 4 for a block. What is drawn once, samples and the equations as printed, is asked of numpy.
"""

import hashlib

import numpy as np

from cdcore.kernels.compiling import hot_kernel, never_inlined
from cdcore.search.state import State

STEP, FIRST_FACTOR, SECOND_FACTOR = (np.uint64(n) for n in (0x9E3779B97F4A7C15, 0xBF58476D1CE4E5B9, 0x94D049BB133111EB))
"""The numbers of SplitMix64: G. Steele, D. Lea, C. Flood, Fast splittable pseudorandom number generators, OOPSLA 2014.
It passes BigCrush, and a search draws a few thousand of its 2^64 numbers."""


def key_of(seed: int, purpose: str, *texts: str) -> int:
    """256 bits that another seed, purpose or word changes."""
    return int.from_bytes(hashlib.sha256("\x1f".join([str(seed), purpose, *texts]).encode()).digest(), "big")


def stream_of(seed: int, purpose: str, first: str, second: str, stamp: float) -> np.random.Generator:
    """A stream that numpy draws, of two bodies in either order, at a time."""
    # A part of the key since keys were written: 0, so that samples stay those drawn so far.
    return np.random.default_rng(key_of(seed, purpose, *sorted((first, second)), float(stamp).hex(), "0"))


@hot_kernel
def draw(state: State) -> float:
    """The next number of the stream of a search, in [0, 1)."""
    never_inlined()
    state.stream += STEP
    word = state.stream
    word = (word ^ (word >> np.uint64(30))) * FIRST_FACTOR
    word = (word ^ (word >> np.uint64(27))) * SECOND_FACTOR
    word = word ^ (word >> np.uint64(31))
    return float(word >> np.uint64(11)) * 2.0**-53
