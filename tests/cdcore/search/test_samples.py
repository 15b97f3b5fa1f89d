"""Samples are drawn by area and nest; a stream is fixed by its seed and names."""

import hashlib

import numpy as np
import pytest
from support.search_scenes import I3, NO_SEEDS, ball_of, exact_pairs, search_of, torus_mesh
from support.shapes import merge_meshes, shift_mesh

from cdcore import TriangleMesh
from cdcore.search.features import NEIGHBOURS, features_of, sample_of
from cdcore.search.state import stream_of

AT_ORIGIN = (I3, np.zeros(3))


def test_samples_are_nested_and_depend_on_the_name():
    """Another name, or another seed, draws other faces."""
    features = features_of(torus_mesh())
    small, large = (set(sample_of(features, size, seed=1, name="ring").pick.tolist()) for size in (50, 400))
    assert (len(small), len(large)) == (50, 400)
    assert small < large
    assert set(sample_of(features, size=50, seed=1, name="hoop").pick.tolist()) != small
    assert set(sample_of(features, size=50, seed=2, name="ring").pick.tolist()) != small


def test_faces_are_drawn_by_their_area():
    """The small ball is far from the origin, where its corners are large and its edges small."""
    small, large = shift_mesh(ball_of(faces=300, radius=0.1), (5, 0, 0)), ball_of(faces=300, radius=1.0)
    features = features_of(merge_meshes(small, large))
    is_large = features.face >= len(small.faces)
    drawn = np.mean([is_large[sample_of(features, size=30, seed=seed, name="a").pick].mean() for seed in range(40)])
    # The large ball has a hundred times the area: 100 / 101 of the sample is expected on it.
    assert drawn > 0.97


@pytest.mark.parametrize("exponent", [-700, 600])
def test_samples_do_not_depend_on_the_size_of_a_mesh(exponent):
    """Products of such edges leave the range of a double; a power of two changes no other rounding."""
    plain = merge_meshes(ball_of(faces=100, radius=0.1), ball_of(faces=100, radius=1.0))
    scaled = TriangleMesh(np.ldexp(plain.vertices, exponent), plain.faces)
    first, second = (sample_of(features_of(mesh), size=20, seed=0, name="a") for mesh in (plain, scaled))
    assert first.pick.tolist() == second.pick.tolist()
    assert first.near_picked.tolist() == second.near_picked.tolist()


def test_neighbours_of_a_sample_are_its_nearest_centroids():
    """100 faces are drawn; the NEIGHBOURS nearest of them to every 37th face of the mesh, by distances of centroids."""
    features = features_of(torus_mesh())
    sample = sample_of(features, size=100, seed=0, name="a")
    centroids = features.rows[:, :3]
    for face in range(0, len(features), 37):
        others = sample.pick[sample.pick != face]
        away = np.linalg.norm(centroids[others] - centroids[face], axis=1)
        mine = np.linalg.norm(centroids[sample.near_picked[face, :NEIGHBOURS]] - centroids[face], axis=1)
        assert np.allclose(np.sort(mine), np.sort(away)[:NEIGHBOURS])


@pytest.mark.parametrize("variant", ["memetic", "corrected", "local", "random", "printed"])
def test_sampled_search_finds_only_pairs_of_sampled_faces(variant):
    """150 of 600 faces of each ball are drawn; from a hit the curve over all faces is followed.

    Memetic and local search must hit if any faces drawn meet; the others may miss them.
    """
    ball = ball_of(faces=600)
    search = search_of(ball, ball, draw=3, samples=150, variant=variant, budget=50_000)
    pose = (I3, np.array([1.2, 0.1, 0.2]))
    truth = exact_pairs(search, ball, ball, pose, AT_ORIGIN)
    first, second = set(search.first.pick.tolist()), set(search.second.pick.tolist())
    left = {(i, j) for i, j in truth if i in first and j in second}
    query = search.search(pose, AT_ORIGIN, stamp=0.0)
    if variant in ("memetic", "local"):
        assert (query.hit is not None) == bool(left)
    if query.hit is not None:
        assert query.hit in left
        assert {tuple(row) for row in search.curve(NO_SEEDS).tolist()} == truth


def first_numbers(*key):
    """Four numbers of the stream of a seed, a purpose, two bodies and a time."""
    return stream_of(*key).random(4).tolist()


def test_random_streams_depend_on_key_not_body_order():
    """Keys are (seed, purpose, two bodies, second)."""
    assert first_numbers(1, "qaco", "rod", "beaker", 0.5) == first_numbers(1, "qaco", "beaker", "rod", 0.5)
    keys = [(1, "qaco", "a", "b", 0.5), (2, "qaco", "a", "b", 0.5), (1, "qaco", "a", "c", 0.5)]
    keys += [(1, "qaco", "a", "b", 0.5000001), (1, "qaco", "ab", "", 0.5), (1, "samples", "a", "b", 0.5)]
    assert len({tuple(first_numbers(*key)) for key in keys}) == len(keys)


def test_first_random_numbers_are_the_same_on_every_machine():
    """Seed, purpose, bodies, time in hexadecimal, and a 0 that every key ends with: hashed, they seed PCG64."""
    key = "\x1f".join(("7", "qaco", "a", "b", "0x1.0000000000000p-1", "0"))
    digest = hashlib.sha256(key.encode()).digest()
    expected = np.random.Generator(np.random.PCG64(int.from_bytes(digest, "big"))).random(4)
    assert first_numbers(7, "qaco", "a", "b", 0.5) == expected.tolist()
