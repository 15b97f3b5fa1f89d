import numpy as np

from replay.effects.pour_events import vector_of


def test_a_place_becomes_plain_numbers():
    place = vector_of(np.array([1.0, 2.0, 3.0]))
    assert place == (1.0, 2.0, 3.0) and all(type(one) is float for one in place)
