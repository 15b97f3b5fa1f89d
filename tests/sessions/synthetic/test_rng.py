from __future__ import annotations

import numpy as np

from sessions.synthetic.rng import random_stream


def test_a_stream_depends_on_its_key_alone():
    first = random_stream(1, "noise", "a", "b").random(5)
    random_stream(1, "other").random(100)
    np.testing.assert_array_equal(first, random_stream(1, "noise", "b", "a").random(5))


def test_every_part_of_the_key_counts():
    keys = [
        random_stream(1, "noise", "a"),
        random_stream(2, "noise", "a"),
        random_stream(1, "loss", "a"),
        random_stream(1, "noise", "b"),
        random_stream(1, "noise"),
        random_stream(1, "noise", "a", stamp_ns=1),
        random_stream(1, "noise", "a", restart=1),
    ]
    assert len({stream.random() for stream in keys}) == len(keys)


def test_the_stream_of_a_known_key_stays_what_it_is():
    # The digest of '[0, "clock", [], 0, 0]' as a little-endian integer seeds PCG64, whose bits NumPy keeps.
    assert random_stream(0, "clock").bit_generator.random_raw(2).tolist() == [1707325541862686270, 16313027572328560223]
