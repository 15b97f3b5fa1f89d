"""State of a search between two calls of its kernel: one record of numbers, one record an ant, and the faces.

Kernels read and write fields as attributes, Python as ``state["field"]``.
"""

from typing import Any, NamedTuple

import numpy as np

from cdcore.numerics import FloatArray, IntArray

OPEN_KEPT, OPEN_ASKED = 64, 8
"""Most pairs left open at a time by the flood fill and by the search, which waits for their answer."""

COUNTS = (
    "evaluations",  # pairs of faces evaluated
    "tests",  # pairs of faces tested for a meeting
    "quiet",  # evaluations since the last hit or restart
    "iterations",  # iterations of the colony
    "restarts",  # populations drawn anew
    "hit_a",  # index of the pair that meets, in each body; -1: none
    "hit_b",
    "best_a",  # index of the closest pair
    "best_b",
    "last_a",  # index of the pair that the last descent started from
    "last_b",
    "start_a",  # index of the pair at which the first ant starts; -1: none
    "start_b",
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
    "found_count",  # pairs that the flood fill found
    "by_corners",  # whether it goes on over corners, not only over edges
    "flood_tests",  # tests that it did
    "asked_by",  # who evaluates, an index of ``ASKED_BY``
    "trace_address",  # where evaluations are traced; 0: nowhere
    "trace_rows",  # rows of the trace
)
NUMBERS = (
    "bodies_size",  # size of both bodies, metres
    "pad",  # added to the radii of faces, metres
    "scale",  # what a distance is divided by, metres
    "closest",  # smallest distance so far, metres
    "turn",  # as in the settings, from here on
    "mutation",
    "alpha",
    "beta",
    "evaporation",
    "reward",
    "pheromone_least",
    "pheromone_most",
)

STATE = np.dtype(
    [
        *((name, np.int64) for name in COUNTS),
        *((name, np.float64) for name in NUMBERS),
        ("open_keys", np.int64, OPEN_KEPT),
        # Poses, rotation by rows, then translation: A and B to world, A to B; after A to B, the largest coordinate of
        # both places in the world.
        ("world_a", np.float64, 12),
        ("world_b", np.float64, 12),
        ("relative", np.float64, 13),
        # Corners of two placed faces; where the stream of random numbers is.
        ("pair", np.float64, 18),
        ("stream", np.uint64),
    ]
)
"""The record of a search."""

ANT = np.dtype(
    [
        ("angles", np.float64, 2),
        ("turned", np.float64, 2),
        *((name, np.float64) for name in ("pheromone", "heuristic", "fitness", "weight")),
    ]
)
"""One ant: an angle a body, now and after the move."""

State = Any
"""What a kernel's author writes for a record of ``STATE``."""
States = Any
"""Records of ``STATE``, the first of which is asked: numba needs 11 us to see what a record is, 1 for an array."""
Swarm = Any
"""Records of ``ANT``."""


class Faces(NamedTuple):
    """The faces of both bodies as ``Features`` keeps them, those a search draws from, and the table of tested pairs."""

    pick_a: IntArray
    pick_b: IntArray
    rows_a: FloatArray
    rows_b: FloatArray
    near_a: IntArray
    near_b: IntArray
    table: IntArray


DONE, STALE, FULL, UNSURE = range(4)
"""What a kernel returns: finished; begins again over corners; an array is full; pairs are left open."""

ASKED_BY = ("start", "ant", "walk", "draw")
"""Who evaluates: the pair to start at, an ant, local search, a random draw."""
START, BY_ANT, WALK, DRAW = range(4)

TRACED = 6
"""Numbers in a row of a trace: both places, distance, iteration, who asked, pheromone of the ant (NaN: no ant)."""
