"""The state of a search between two calls of its kernel: arrays, and a name for every place in them."""

# Counters, int64: what was spent. QUIET: evaluations since the last hit or restart; CURSOR: random numbers used.
EVALUATIONS, TESTS, QUIET, ITERATIONS, CURSOR = range(5)
# Places of the pair that meets (-1: none), of the closest pair, of the pair the last descent started from.
HIT_A, HIT_B, BEST_A, BEST_B, LAST_A, LAST_B = range(5, 11)
# Mark of this search's entries in the table of tested pairs; pairs the filter left open, ever and now; entries.
GENERATION, UNDECIDED, OPEN, ENTRIES = range(11, 15)
# Limits and choices. FRESH: whether the population is still to be drawn; ROUNDS: of the local search.
BUDGET, RESTART_AFTER, ANTS, DAEMON, WITHOUT, AMPLITUDE, FRESH, ROUNDS = range(15, 23)
# Of the flood fill: next pair to look around, pairs found, whether it goes over corners, tests done.
HEAD, FOUND_COUNT, BY_CORNERS, FLOOD_TESTS = range(23, 27)
# The pair the colony's first ant starts at (-1: none); from OPEN_FIRST on the keys of pairs left open.
START_A, START_B, OPEN_FIRST = range(27, 30)

OPEN_KEPT, OPEN_ASKED = 64, 8
"""Most pairs left open at a time by the flood fill and by the search, which waits for their answer."""
COUNTERS = OPEN_FIRST + OPEN_KEPT

# Numbers, float64.
PAD, SCALE, TURN, MUTATION, ALPHA, BETA, EVAPORATION, REWARD, LEAST, MOST, CLOSEST = range(11)
NUMBERS = 11

# Columns of the swarm, one row an ant.
FIRST_ANGLE, SECOND_ANGLE, NEXT_FIRST, NEXT_SECOND, PHEROMONE, HEURISTIC, FITNESS, WEIGHT = range(8)
ANT = 8

# Poses, rotation by rows then translation: A to world, B to world, A to B.
WORLD_A, WORLD_B, RELATIVE, POSES = 0, 12, 24, 36

SPENT, FOUND, HUNGRY, STALE, FULL, UNSURE = range(6)
"""What a kernel returns: finished without a hit; a pair meets; needs more random numbers; wants a restart; an array is
full; pairs are left open."""
