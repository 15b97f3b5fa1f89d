"""No two names of the search's arrays mean the same place, and every place lies inside its array."""

from cdcore.search import state

COUNTS = "EVALUATIONS TESTS QUIET ITERATIONS CURSOR HIT_A HIT_B BEST_A BEST_B LAST_A LAST_B GENERATION UNDECIDED OPEN"
COUNTS += " ENTRIES BUDGET RESTART_AFTER ANTS DAEMON WITHOUT AMPLITUDE FRESH ROUNDS HEAD FOUND_COUNT BY_CORNERS"
COUNTS += " FLOOD_TESTS START_A START_B OPEN_FIRST"
REALS = "PAD SCALE TURN MUTATION ALPHA BETA EVAPORATION REWARD LEAST MOST CLOSEST"
COLUMNS = "FIRST_ANGLE SECOND_ANGLE NEXT_FIRST NEXT_SECOND PHEROMONE HEURISTIC FITNESS WEIGHT"


def places(names):
    return [getattr(state, name) for name in names.split()]


def test_places_are_numbered_through():
    assert places(COUNTS) == list(range(state.OPEN_FIRST + 1))
    assert places(REALS) == list(range(state.NUMBERS))
    assert places(COLUMNS) == list(range(state.ANT))
    assert sorted(places("SPENT FOUND HUNGRY STALE FULL UNSURE")) == list(range(6))


def test_pairs_left_open_fit_behind_the_counters():
    assert state.COUNTERS == state.OPEN_FIRST + state.OPEN_KEPT
    assert state.OPEN_ASKED <= state.OPEN_KEPT
    assert places("WORLD_A WORLD_B RELATIVE POSES") == [0, 12, 24, 36]
