import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from sessions.doctor.runs import runs


@given(st.lists(st.booleans(), max_size=40))
def test_the_runs_of_a_mask_make_the_mask_again(mask):
    again = np.zeros(len(mask), dtype=bool)
    found = runs(np.array(mask, dtype=bool))
    for first, last in found.tolist():
        assert not again[first : last + 1].any()
        again[first : last + 1] = True
    assert again.tolist() == mask
    assert (found[1:, 0] > found[:-1, 1] + 1).all()
