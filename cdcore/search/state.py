"""State of a search between two calls of its kernel: one record of numbers, one record an ant, and the faces.

Kernels read and write fields as attributes, Python as ``state["field"]``.

Its random numbers depend on the seed, the two bodies and the stamp, and on nothing else. A search draws them in its
kernel: drawn by numpy, they took a quarter of a live sample (2026-11), 8 microseconds for a stream and 4 for a block.
numpy draws what is drawn once: samples of faces, and the equations as printed.
"""

import hashlib
from typing import Any, NamedTuple

import numpy as np

from cdcore.kernels.compiling import hot_kernel, never_inlined
from cdcore.numerics import FloatArray, IntArray

OPEN_KEPT, OPEN_SEARCHED = 64, 8
"""Most pairs left open at a time by the flood fill and by the search, which waits for their answer."""

COUNTS = (
    "evaluations",  # pairs of faces evaluated
    "tests",  # pairs of faces tested for a meeting
    "quiet",  # evaluations since the last hit or restart
    "iterations",  # iterations of the colony
    "restarts",  # populations drawn anew
    "hit_a",  # index of the face of A in the pair that meets; -1: none
    "hit_b",  # index of the face of B in that pair
    "best_a",  # index of the face of A in the closest pair
    "best_b",  # index of the face of B in that pair
    "last_a",  # index of the face of A in the pair that the last descent started from
    "last_b",  # index of the face of B in that pair
    "start_a",  # index of the face of A at which the first ant starts; -1: none
    "start_b",  # index of the face of B at which it starts
    "generation",  # mark of the entries of this search in the table of tested pairs
    "entries",  # number of these entries
    "undecided",  # pairs that the filter ever left open
    "open",  # pairs that it leaves open now
    "budget",  # most evaluations
    "restart_after",  # quiet evaluations before the population is drawn anew
    "ants",  # size of the population
    "searcher",  # colony, local search or random draws
    "descends_from_start",  # whether local search begins at the start
    "improves_best",  # whether local search improves the best ant of each iteration
    "left_out_equation",  # number of an equation of the paper that is not applied; 0: none
    "fresh",  # whether the population is still to be drawn
    "head",  # next pair of the flood fill to look around
    "contact_count",  # pairs that the flood fill met
    "by_corners",  # whether it goes on over corners, not only over edges
    "flood_tests",  # tests that it did
    "source",  # where the pair that is evaluated comes from, an index of ``SOURCES``
    "trace_address",  # where evaluations are traced; 0: nowhere
    "trace_rows",  # rows of the trace
)
"""Whole numbers of a search."""

NUMBERS = (
    "bodies_size",  # size of both bodies, metres
    "pad",  # added to the radii of faces, metres
    "scale",  # what a distance is divided by, metres
    "closest",  # smallest distance so far, metres
    "followed",  # distance of the pair that was evaluated by itself, metres
    "turn",  # largest step of a rotation, radians
    "mutation",  # probability of a NOT gate
    "alpha",  # weight of the pheromone in (16)
    "beta",  # weight of the heuristic in (16)
    "evaporation",  # rho of (20)
    "reward",  # exponent of (19)
    "pheromone_least",  # smallest pheromone of an ant
    "pheromone_most",  # largest pheromone of an ant
)
"""Real numbers of a search."""

ARRAYS = (
    ("open_keys", np.int64, OPEN_KEPT),  # pairs that the filter leaves open, a number each
    ("world_a", np.float64, 12),  # pose of A in the world: rotation by rows, then translation
    ("world_b", np.float64, 12),  # pose of B in the world
    ("relative", np.float64, 13),  # pose of A in the frame of B, then the largest coordinate of both translations
    ("pair", np.float64, 18),  # corners of two placed faces
    ("stream", np.uint64),  # state of the stream of random numbers
)
"""Arrays of a search."""

SEARCH_RECORD = np.dtype([*((name, np.int64) for name in COUNTS), *((name, np.float64) for name in NUMBERS), *ARRAYS])
"""The record of a search."""

ANT = np.dtype(
    [
        ("angles", np.float64, 2),  # an angle a body
        ("next_angles", np.float64, 2),  # the angles after the move
        ("pheromone", np.float64),  # tau of (16)
        ("heuristic", np.float64),  # eta of (16)
        ("fitness", np.float64),  # 1 at distance 0, falling with it
        ("weight", np.float64),  # sum of the weights by which an ant is followed, up to this ant
    ]
)
"""One ant."""

State = Any
"""What a kernel's author writes for a record of ``SEARCH_RECORD``."""
States = Any
"""Records of ``SEARCH_RECORD``, the running search first: numba needs 11 us to see what a record is, 1 for an array."""
Swarm = Any
"""Records of ``ANT``."""


class Faces(NamedTuple):
    """The faces of both bodies as ``Features`` keeps them, those a search draws from, and the table of tested pairs."""

    pick_a: IntArray
    """(S,) indices of the faces of A that a search draws from."""
    pick_b: IntArray
    """(S,) the same of B."""
    rows_a: FloatArray
    """(f, 13) centroid, radius and corners of each face of A."""
    rows_b: FloatArray
    """(f, 13) the same of B."""
    near_a: IntArray
    """(f, 15) neighbours of each face of A."""
    near_b: IntArray
    """(f, 15) the same of B."""
    table: IntArray
    """(n, 2) key and generation of each tested pair."""


DONE, STALE, FULL, UNSURE = range(4)
"""What a kernel returns: finished; begins again over corners; an array is full; pairs are left open."""

SOURCES = ("start", "ant", "local search", "draw")
"""Where a pair that is evaluated comes from: the pair to start at, an ant, a step of local search, a random draw."""
FROM_START, FROM_ANT, FROM_DESCENT, FROM_DRAW = range(4)

TRACED = 6
"""Numbers in a row of a trace: both indices, distance, iteration, source, pheromone of the ant (NaN: no ant)."""

STREAM_STEP, FIRST_FACTOR, SECOND_FACTOR = (
    np.uint64(n) for n in (0x9E3779B97F4A7C15, 0xBF58476D1CE4E5B9, 0x94D049BB133111EB)
)
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
    state.stream += STREAM_STEP
    word = state.stream
    word = (word ^ (word >> np.uint64(30))) * FIRST_FACTOR
    word = (word ^ (word >> np.uint64(27))) * SECOND_FACTOR
    word = word ^ (word >> np.uint64(31))
    return float(word >> np.uint64(11)) * 2.0**-53
