"""Random numbers that depend on the seed, the two bodies, the stamp and the restart, and on nothing else."""

import hashlib
from typing import Any, Final

import numpy as np
from numpy.random.bit_generator import ISeedSequence
from numpy.typing import NDArray

from cdcore.kernels.compiling import become_part_of_caller, hot_kernel, kernel
from cdcore.numerics import IntArray

BLOCK = 512
"""Numbers drawn at a time; the answers are the same for any block."""
LOW: Final = (1 << 32) - 1
POOL: Final = 4


def stream_of(
    seed: int, first: str, second: str, stamp: float, restart: int, *, purpose: str = "qaco"
) -> np.random.Generator:
    """The stream of one restart of one search; bodies in either order.

    Each restart has a separate stream. So the answer does not depend on block sizes, workers or other pairs. It is that
    of ``numpy.random.PCG64(key)``, whose own ``SeedSequence`` takes 35 us more: 1.05 to 1.22 of a run of
    ``hybrid-qaco`` on a bench (2026-11).
    """
    words = [str(seed), purpose, *sorted((first, second)), float(stamp).hex(), str(restart)]
    key = hashlib.sha256("\x1f".join(words).encode()).digest()
    spread_key: Any = Spread(key)
    return np.random.Generator(np.random.PCG64(spread_key))


class Spread(ISeedSequence):
    """What numpy's ``SeedSequence`` makes of a number of 32 bytes."""

    def __init__(self, key: bytes) -> None:
        self._words = np.empty(2 * POOL, dtype=np.int64)
        # least word first
        spread(np.frombuffer(key[::-1], dtype="<u4").astype(np.int64), self._words)

    def generate_state(self, n_words: int, _dtype: Any = np.uint64) -> NDArray[Any]:
        """Four words of 64 bits, as a bit generator asks for them."""
        return self._words.astype("<u4").view(np.uint64)[:n_words]


@hot_kernel
def hashed(value: int, before: int, after: int) -> int:
    """A number of 32 bits mixed with two constants."""
    become_part_of_caller()
    mixed = ((value ^ before) * after) & LOW
    return mixed ^ (mixed >> 16)


@kernel
def spread(parts: IntArray, words: IntArray) -> None:
    """Fill ``words`` (8,) from ``parts`` (8,), least first; parts of 0 at the end do not count.

    Source: numpy.random.SeedSequence, after M. O'Neill, Developing a seed_seq alternative (2015).
    """
    pool, constant, count = np.zeros(POOL, dtype=np.int64), 0x43B0D7E5, len(parts)
    while count > 1 and parts[count - 1] == 0:
        count -= 1
    # the pool is filled, then its numbers are mixed with each other, then with what is left of the key
    for source in range(2 * POOL + max(0, count - POOL)):
        for place in range(POOL):
            filling = source < POOL
            if (filling and place != source) or (not filling and source - POOL == place):
                continue
            inside = POOL <= source < 2 * POOL
            value = pool[source - POOL] if inside else parts[source if filling else source - POOL]
            following = (constant * 0x931E8875) & LOW
            value = hashed(value, constant, following)
            constant = following
            if not filling:
                mixed = (pool[place] * 0xCA01F9DD - value * 0x4973F715) & LOW
                value = mixed ^ (mixed >> 16)
            pool[place] = value
    constant = 0x8B51F9DD
    for k in range(2 * POOL):
        following = (constant * 0x58F38DED) & LOW
        words[k] = hashed(pool[k % POOL], constant, following)
        constant = following
