"""A stream is fixed by seed, names, stamp and restart, and any other of them gives another."""

import numpy as np

from cdcore.search.rng import stream_of


def first(*key):
    return stream_of(*key).random(4).tolist()


def test_the_same_key_gives_the_same_numbers_in_either_order_of_bodies():
    assert first(1, "rod", "beaker", 0.5, 0) == first(1, "beaker", "rod", 0.5, 0)


def test_another_seed_pair_frame_or_restart_gives_another_stream():
    keys = [(1, "a", "b", 0.5, 0), (2, "a", "b", 0.5, 0), (1, "a", "c", 0.5, 0), (1, "a", "b", 0.5000001, 0)]
    keys += [(1, "a", "b", 0.5, 1), (1, "ab", "", 0.5, 0)]
    assert len({tuple(first(*key)) for key in keys}) == len(keys)


def test_numbers_do_not_depend_on_how_many_are_drawn_at_a_time():
    whole, parts = stream_of(0, "a", "b", 0.0, 0), stream_of(0, "a", "b", 0.0, 0)
    assert np.array_equal(whole.random(100), np.concatenate([parts.random(33), parts.random(67)]))


def test_the_first_numbers_of_a_known_key_are_these_on_every_machine():
    import hashlib

    key = hashlib.sha256(b"7\x1fqaco\x1fa\x1fb\x1f0x1.0000000000000p-1\x1f3").digest()
    expected = np.random.Generator(np.random.PCG64(int.from_bytes(key, "big"))).random(4)
    assert first(7, "a", "b", 0.5, 3) == expected.tolist()
