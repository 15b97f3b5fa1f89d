"""The arrays a search lives in between two calls of its kernel, every place in them named."""

from __future__ import annotations

# counters, int64
EVALUATIONS, TESTS, QUIET, ITERATIONS, CURSOR = 0, 1, 2, 3, 4
"""Spent so far; triangle tests; evaluations since the last hit or restart; iterations; random numbers used."""
HIT_A, HIT_B, BEST_A, BEST_B, LAST_A, LAST_B = 5, 6, 7, 8, 9, 10
"""Places of the pair that meets (-1: none), of the closest pair, of the pair the last descent started from."""
GENERATION, UNDECIDED, OPEN, ENTRIES = 11, 12, 13, 14
"""Mark of this search's entries in the table of tested pairs; pairs the filter left open, ever and now; entries of
this generation."""
BUDGET, RESTART_AFTER, ANTS, DAEMON, WITHOUT, AMPLITUDE, FRESH, ROUNDS = 15, 16, 17, 18, 19, 20, 21, 22
"""Limits and choices; FRESH: whether the population is still to be drawn; ROUNDS: of the local search."""
HEAD, FOUND_COUNT, BY_CORNERS, FLOOD_TESTS, START_A, START_B = 23, 24, 25, 26, 27, 28
"""Of the flood fill: next pair to look around, pairs found, whether it goes over corners, tests done. Of the colony:
the pair its first ant starts at (-1: none)."""
OPEN_FIRST = 29
"""From here on the keys of pairs left open."""
OPEN_KEPT, OPEN_ASKED = 64, 8
"""Most pairs left open at a time by the flood fill and by the search, which waits for their answer."""
COUNTERS = OPEN_FIRST + OPEN_KEPT

# numbers, float64
PAD, SCALE, TURN, MUTATION, ALPHA, BETA, EVAPORATION, REWARD, LEAST, MOST, CLOSEST = 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10
NUMBERS = 11

# columns of the swarm, one row an ant
FIRST_ANGLE, SECOND_ANGLE, NEXT_FIRST, NEXT_SECOND, PHEROMONE, HEURISTIC, FITNESS, WEIGHT = 0, 1, 2, 3, 4, 5, 6, 7
ANT = 8

# poses, rotation by rows then translation: A to world, B to world, A to B
WORLD_A, WORLD_B, RELATIVE, POSES = 0, 12, 24, 36

# what a kernel returns
SPENT, FOUND, HUNGRY, STALE, FULL, UNSURE = 0, 1, 2, 3, 4, 5
"""Finished without a hit; a pair meets; needs more random numbers; wants a restart; an array is full; pairs are left
open."""
