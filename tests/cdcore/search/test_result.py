"""A look says why it ended, and names a hit only where there is one."""

import numpy as np
from support.search_scenes import I3, ball_of, search_of


def test_a_look_ends_with_a_hit_or_with_its_budget():
    ball = ball_of(400)
    search = search_of(ball, ball, budget=3000)
    hit = search.look((I3, np.array([1.5, 0, 0])), (I3, np.zeros(3)), 0.0)
    none = search.look((I3, np.array([9.0, 0, 0])), (I3, np.zeros(3)), 0.0)
    assert (hit.reason, none.reason) == ("hit", "budget")
    assert hit.hit is not None
    assert none.hit is None
    assert none.evaluations == 3000
    assert 6.9 < none.distance < 7.5
