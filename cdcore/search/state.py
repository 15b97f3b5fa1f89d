"""State of a search between two calls of its kernel: one record of numbers, one record an ant, and the faces.

Kernels read and write fields as attributes, Python as ``state["field"]``.
"""

from typing import Any, NamedTuple

import numpy as np

from cdcore.numerics import FloatArray, IntArray

OPEN_KEPT, OPEN_ASKED = 64, 8
"""Most pairs left open at a time by the flood fill and by the search, which waits for their answer."""

COUNTS = (
    # What was spent; evaluations since the last hit or restart; populations drawn anew.
    "evaluations", "tests", "quiet", "iterations", "restarts",
    # Places of the pair that meets (-1: none), of the closest pair, of the pair the last descent started from, and of
    # the pair the colony's first ant starts at (-1: none).
    "hit_a", "hit_b", "best_a", "best_b", "last_a", "last_b", "start_a", "start_b",
    # Mark of this search's entries in the table of tested pairs, and their number; pairs the filter left open, ever and
    # now.
    "generation", "entries", "undecided", "open",
    # Limits and choices: who searches, whether a start is walked down from, whether the best ant is improved by local
    # search, the equation left out (0: none), whether the population is still to be drawn.
    "budget", "restart_after", "ants", "who", "walk", "daemon", "without", "fresh",
    # Of the flood fill: next pair to look around, pairs found, whether it goes over corners, tests done.
    "head", "found_count", "by_corners", "flood_tests",
    # Who evaluates, a place in ``ASKED_BY``; address of the trace (0: nobody watches) and its rows.
    "asked_by", "trace_address", "trace_rows",
)  # fmt: skip
NUMBERS = (
    # Size of both bodies; added to the radii of faces; what a distance is divided by; smallest distance so far.
    "bodies_size", "pad", "scale", "closest",
    # As in the settings.
    "turn", "mutation", "alpha", "beta", "evaporation", "reward", "pheromone_least", "pheromone_most",
)  # fmt: skip

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
