"""Samples of faces are drawn by area and nest; a stream of random numbers is fixed by its seed and names."""

import hashlib

import numpy as np
import pytest
from support.search_scenes import I3, NO_SEEDS, ball_of, exact_pairs, search_of, torus_mesh
from support.shapes import merge_meshes, shift_mesh

from cdcore import TriangleMesh
from cdcore.search.features import NEIGHBOURS, features_of, sample_of
from cdcore.search.state import stream_of

AT_ORIGIN = (I3, np.zeros(3))
CROSSING = (I3, np.array([1.2, 0.1, 0.2]))
"""Of a ball of radius 1 m, so that it crosses another in the origin."""


def test_samples_are_nested_and_depend_on_the_name():
    """50 faces of a torus are drawn, and 400, among them those 50; another name, or another seed, draws other faces."""
    features = features_of(torus_mesh())
    small, large = (set(sample_of(features, size, seed=1, name="ring").pick.tolist()) for size in (50, 400))
    assert (len(small), len(large)) == (50, 400)
    assert small < large
    assert set(sample_of(features, size=50, seed=1, name="hoop").pick.tolist()) != small
    assert set(sample_of(features, size=50, seed=2, name="ring").pick.tolist()) != small


def test_faces_are_drawn_by_their_area():
    """30 faces of two balls of 300, of radius 0.1 and 1 m, by 40 seeds: the large one has a hundred times the area.

    So 100 / 101 of a sample is expected on it. The small one is 5 m from the origin, where its corners are large
    numbers.
    """
    small, large = shift_mesh(ball_of(faces=300, radius=0.1), (5, 0, 0)), ball_of(faces=300, radius=1.0)
    features = features_of(merge_meshes(small, large))
    is_large = features.face >= len(small.faces)
    drawn = np.mean([is_large[sample_of(features, size=30, seed=seed, name="a").pick].mean() for seed in range(40)])
    assert drawn > 0.97


@pytest.mark.parametrize("exponent", [-700, 600])
def test_samples_do_not_depend_on_the_size_of_a_mesh(exponent):
    """Two balls scaled by 2^exponent: products of such edges leave the range of a double.

    A power of two changes no other rounding: the same faces are drawn, with the same neighbours.
    """
    balls = merge_meshes(ball_of(faces=100, radius=0.1), ball_of(faces=100, radius=1.0))
    scaled = TriangleMesh(np.ldexp(balls.vertices, exponent), balls.faces)
    sample, sample_of_scaled = (sample_of(features_of(mesh), size=20, seed=0, name="a") for mesh in (balls, scaled))
    assert sample_of_scaled.pick.tolist() == sample.pick.tolist()
    assert sample_of_scaled.near_picked.tolist() == sample.near_picked.tolist()


def test_neighbours_of_a_sample_are_its_nearest_centroids():
    """100 faces of a torus are drawn; every 37th face of all has the NEIGHBOURS of them whose centroids are nearest."""
    features = features_of(torus_mesh())
    sample = sample_of(features, size=100, seed=0, name="a")
    centroids = features.rows[:, :3]
    for face in range(0, len(features), 37):
        drawn = sample.pick[sample.pick != face]
        expected = np.sort(np.linalg.norm(centroids[drawn] - centroids[face], axis=1))[:NEIGHBOURS]
        neighbours = sample.near_picked[face, :NEIGHBOURS]
        distances = np.linalg.norm(centroids[neighbours] - centroids[face], axis=1)
        assert np.allclose(np.sort(distances), expected), face


def search_of_sampled_balls(variant):
    """A search of 150 faces each of two balls of radius 1 m, and the face pairs of all that meet at the
    pose CROSSING.
    """
    ball = ball_of(faces=600)
    search = search_of(ball, ball, draw=3, samples=150, variant=variant, budget=50_000)
    return search, exact_pairs(search, ball, ball, CROSSING, AT_ORIGIN)


@pytest.mark.parametrize("variant", ["memetic", "corrected", "local", "random", "printed"])
def test_sampled_search_finds_only_pairs_of_sampled_faces(variant):
    """150 of 600 faces of two balls each are drawn, and some of them meet; a hit is one of these pairs, unless a search
    misses them all.
    """
    search, meeting = search_of_sampled_balls(variant)
    first_drawn, second_drawn = set(search.first.pick.tolist()), set(search.second.pick.tolist())
    drawn_and_meeting = {(i, j) for i, j in meeting if i in first_drawn and j in second_drawn}
    assert drawn_and_meeting
    query = search.search(CROSSING, AT_ORIGIN, stamp=0.0)
    assert query.hit in {None, *drawn_and_meeting}


@pytest.mark.parametrize("variant", ["memetic", "local"])
def test_curve_from_a_sampled_hit_has_undrawn_faces(variant):
    """150 of 600 faces of two balls each are drawn, and these searches hit two of them that meet: from there all face
    pairs of the balls that meet are found.
    """
    search, meeting = search_of_sampled_balls(variant)
    assert search.search(CROSSING, AT_ORIGIN, stamp=0.0).hit is not None
    assert {tuple(row) for row in search.curve(NO_SEEDS).tolist()} == meeting


def first_numbers(seed, purpose, first_body, second_body, seconds):
    """Four numbers of the stream of a seed, a purpose, two bodies and a time."""
    return stream_of(seed, purpose, first_body, second_body, seconds).random(4).tolist()


def test_random_streams_do_not_depend_on_body_order():
    """The random numbers of a search of rod and beaker, and of beaker and rod, at 0.5 s."""
    assert first_numbers(1, "qaco", "rod", "beaker", 0.5) == first_numbers(1, "qaco", "beaker", "rod", 0.5)


@pytest.mark.parametrize(
    "other_key",
    [
        pytest.param((2, "qaco", "a", "b", 0.5), id="seed"),
        pytest.param((1, "samples", "a", "b", 0.5), id="purpose"),
        pytest.param((1, "qaco", "a", "c", 0.5), id="body"),
        pytest.param((1, "qaco", "ab", "", 0.5), id="names that read alike in a row"),
        pytest.param((1, "qaco", "a", "b", 0.5000001), id="time"),
    ],
)
def test_random_streams_depend_on_each_entry_of_their_key(other_key):
    """Seed 1, purpose qaco, bodies a and b, 0.5 s; in another key an entry differs."""
    assert first_numbers(*other_key) != first_numbers(1, "qaco", "a", "b", 0.5)


def test_first_random_numbers_are_the_same_on_every_machine():
    """Seed, purpose, bodies, time in hexadecimal, and a 0 that every key ends with: their SHA-256 seeds PCG64."""
    key = "\x1f".join(("7", "qaco", "a", "b", "0x1.0000000000000p-1", "0"))
    digest = hashlib.sha256(key.encode()).digest()
    expected = np.random.Generator(np.random.PCG64(int.from_bytes(digest, "big"))).random(4)
    assert first_numbers(7, "qaco", "a", "b", 0.5) == expected.tolist()
