"""No two names of the search's counters mean the same place, and pairs left open fit behind them."""

from cdcore.search import state


def test_the_counters_are_numbered_through_up_to_the_pairs_left_open():
    first, last = list(vars(state)).index("EVALUATIONS"), list(vars(state)).index("OPEN_FIRST")
    assert list(vars(state).values())[first : last + 1] == list(range(state.OPEN_FIRST + 1))
    assert (state.COUNTERS, state.OPEN_ASKED <= state.OPEN_KEPT) == (state.OPEN_FIRST + state.OPEN_KEPT, True)
