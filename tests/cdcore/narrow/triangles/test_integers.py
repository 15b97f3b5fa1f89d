"""The integer test is right on cases small enough to see, at any scale of the numbers."""

import itertools

import pytest

from cdcore.narrow.triangles.integers import integers_on_one_scale, pair_intersects_integers

FLOOR = [[0, 0, 0], [4, 0, 0], [0, 4, 0]]
CASES = [
    ("corner on face", [[1, 1, 0], [1, 2, 4], [2, 1, 4]], True),
    ("just above", [[1, 1, 1], [1, 2, 4], [2, 1, 4]], False),
    ("corner to corner", [[0, 0, 0], [-1, 0, 0], [0, -1, 0]], True),
    ("coplanar apart", [[5, 5, 0], [6, 5, 0], [5, 6, 0]], False),
    ("coplanar inside", [[1, 1, 0], [2, 1, 0], [1, 2, 0]], True),
    ("point on face", [[1, 1, 0]] * 3, True),
    ("point beside face in its plane", [[3, 3, 0]] * 3, False),
    ("segment through", [[1, 1, -1], [1, 1, 1], [1, 1, 0]], True),
    ("segment in plane across", [[-1, 1, 0], [5, 1, 0], [2, 1, 0]], True),
    ("segment past a corner", [[-1, 0, 1], [0, -1, -1], [-1, 0, 1]], False),
]


@pytest.mark.parametrize(("name", "other", "meets"), CASES, ids=[case[0] for case in CASES])
@pytest.mark.parametrize("scale", [1.0, 2.0**-900, 2.0**900])
def test_a_case_one_can_see(name, other, meets, scale):
    first, second = ([[x * scale for x in corner] for corner in triangle] for triangle in (FLOOR, other))
    assert pair_intersects_integers([first, second]) is meets
    assert pair_intersects_integers([second, first]) is meets


def test_segments_and_points_meet_only_where_they_do():
    ends = {"a": [0, 0, 0], "b": [2, 2, 2], "m": [1, 1, 1], "off": [1, 1, 2], "past": [3, 3, 3]}
    flat = {key: [float(x) for x in point] for key, point in ends.items()}
    long = [flat["a"], flat["b"], flat["m"]]
    for order in itertools.permutations(long):
        assert pair_intersects_integers([order, [flat["m"]] * 3])
        assert not pair_intersects_integers([order, [flat["off"]] * 3])
        assert not pair_intersects_integers([order, [flat["past"]] * 3])
        assert pair_intersects_integers([order, [flat["past"], flat["m"], flat["b"]]])


def test_scaling_keeps_ratios_of_the_smallest_and_largest_doubles():
    small, large = integers_on_one_scale([5e-324, 1.0])
    assert (small, large) == (1, 2**1074)
