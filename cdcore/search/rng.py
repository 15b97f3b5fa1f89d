"""Random numbers that depend on the seed, the two bodies, the stamp and the restart, and on nothing else.

Kernels draw them one by one, the same numbers as numpy's from the same key. Asked of numpy in blocks, they took a
quarter of a live look (2026-11): 8 microseconds for a stream and 4 for a block.
"""

import hashlib
from collections.abc import Callable
from typing import Any, Final

import numpy as np
from llvmlite import ir
from numba import types

from cdcore.kernels.compiling import hot_kernel, machine_operation, stay_one_function
from cdcore.search.state import State

WORD: Final = (1 << 32) - 1
POOL: Final = 4
"""Words of the pool in which ``SeedSequence`` mixes its eight."""

HIGH_FACTOR, LOW_FACTOR = np.uint64(0x2360ED051FC65DA4), np.uint64(0x4385DF649FCCF645)
"""The factor of PCG64, M. O'Neill 2014."""
LAST_BIT, HALF_WORD = np.uint64(1), np.uint64(32)
ALL_BUT_ONE, ROTATION, WIDTH, UNUSED = np.uint64(63), np.uint64(58), np.uint64(64), np.uint64(11)


def key_of(seed: int, first: str, second: str, stamp: float, restart: int, *, purpose: str = "qaco") -> bytes:
    """The key of the stream of one restart of one search, least byte first; bodies in either order.

    Each restart has a separate stream. So the answer does not depend on workers or other pairs.
    """
    words = [str(seed), purpose, *sorted((first, second)), float(stamp).hex(), str(restart)]
    return hashlib.sha256("\x1f".join(words).encode()).digest()[::-1]


def stream_of(
    seed: int, first: str, second: str, stamp: float, restart: int, *, purpose: str = "qaco"
) -> np.random.Generator:
    """That stream as numpy draws it."""
    key = key_of(seed, first, second, stamp, restart, purpose=purpose)
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(np.frombuffer(key, dtype="<u4"))))


def _high_half(_context: Any, _first: Any, _second: Any) -> Any:
    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        wide = ir.IntType(128)
        product = builder.mul(*(builder.zext(factor, wide) for factor in arguments))
        return builder.trunc(builder.lshr(product, wide(64)), ir.IntType(64))

    return types.uint64(types.uint64, types.uint64), generate


high_half: Callable[[Any, Any], Any] = machine_operation(_high_half)
"""The upper 64 bits of the product of two unsigned numbers; kernels only."""


@hot_kernel
def hashed(word: int, factor: int, next_factor: int) -> int:
    """A word hashed with two factors of a row of them, as ``SeedSequence`` does."""
    word = ((word ^ factor) * next_factor) & WORD
    return word ^ (word >> 16)


@hot_kernel
def mixed(first: int, second: int) -> int:
    """Two words made one, as ``SeedSequence`` does."""
    word = (0xCA01F9DD * first - 0x4973F715 * second) & WORD
    return word ^ (word >> 16)


@hot_kernel
def mix_in(word: int, except_place: int, factor: int, state: State) -> int:
    """Mix a word into the pool, but for one place of it; returns the factor to go on with."""
    for place in range(POOL):
        if place != except_place:
            following = (factor * 0x931E8875) & WORD
            state.pool[place] = mixed(state.pool[place], hashed(word, factor, following))
            factor = following
    return factor


@hot_kernel
def seed_stream(state: State) -> None:
    """Begin the stream of the key in the state: numpy's ``SeedSequence``, then its ``PCG64``."""
    stay_one_function()
    factor = 0x43B0D7E5
    for place in range(POOL):
        following = (factor * 0x931E8875) & WORD
        state.pool[place] = hashed(state.key[place], factor, following)
        factor = following
    for place in range(POOL):
        factor = mix_in(state.pool[place], place, factor, state)
    for place in range(POOL, 2 * POOL):
        factor = mix_in(state.key[place], POOL, factor, state)
    factor = 0x8B51F9DD
    for place in range(2 * POOL):
        following = (factor * 0x58F38DED) & WORD
        half = np.uint64(hashed(state.pool[place % POOL], factor, following))
        factor = following
        if place % 2 == 0:
            state.stream[place // 2] = half
        else:
            state.stream[place // 2] |= half << HALF_WORD
    start_high, start_low, step_high, step_low = state.stream[0], state.stream[1], state.stream[2], state.stream[3]
    state.stream[2] = (step_high << LAST_BIT) | (step_low >> ALL_BUT_ONE)
    state.stream[3] = (step_low << LAST_BIT) | LAST_BIT
    state.stream[0], state.stream[1] = state.stream[2], state.stream[3]
    add(start_high, start_low, state)
    draw(state)


@hot_kernel
def add(high: int, low: int, state: State) -> None:
    """Add a number of 128 bits to where the stream is."""
    total = state.stream[1] + low
    state.stream[0] += high + (LAST_BIT if total < low else np.uint64(0))
    state.stream[1] = total


@hot_kernel
def draw(state: State) -> float:
    """The next number of the stream, in [0, 1): ``Generator.random`` of a ``PCG64``."""
    stay_one_function()
    high, low = state.stream[0], state.stream[1]
    state.stream[0] = high_half(low, LOW_FACTOR) + high * LOW_FACTOR + low * HIGH_FACTOR
    state.stream[1] = low * LOW_FACTOR
    add(state.stream[2], state.stream[3], state)
    bits, turn = state.stream[0] ^ state.stream[1], state.stream[0] >> ROTATION
    bits = (bits >> turn) | (bits << ((WIDTH - turn) & ALL_BUT_ONE))
    return float(bits >> UNUSED) * 2.0**-53
