"""In every fixture the wanted number of faces meets, to 2 %, and the truth is that of the exhaustive test."""

import numpy as np
import pytest

from cdcore.narrow.brute_force import meeting_faces_exhaustive
from cdcore.poses import place_points
from replay.studies.paper import fixtures
from replay.studies.paper.fixtures import (
    FAMILY_NAMES,
    POSES_PER_TARGET,
    TARGET_FACES,
    TARGET_TOLERANCE,
    FixtureError,
    faces_of_pairs,
    make_fixture,
    sphere,
    torus,
)

MORE = [(100, 3), *[(target, number) for target in TARGET_FACES for number in range(POSES_PER_TARGET)][::9]]
"""Both families at every target."""


def truth_of(one):
    """Faces of a fixture that meet, by the exhaustive test."""
    world = [
        place_points(body.mesh.triangles, one.motion.rotations[0, k], one.motion.translations[0, k])
        for k, body in enumerate(one.bodies)
    ]
    return meeting_faces_exhaustive(*world)


@pytest.mark.slow
@pytest.mark.parametrize(("target", "number"), [(100, 0), *MORE])
def test_requested_number_of_faces_meets_and_exhaustion_agrees(target, number):
    """``number``: of the fixture for a target, even ones of the first family; the exhaustive test gives the pairs."""
    item = make_fixture(target, number)
    assert abs(item.faces - target) <= TARGET_TOLERANCE * target
    assert item.family == FAMILY_NAMES[number % 2]
    assert np.array_equal(item.pairs, truth_of(item))


def test_fixture_depends_on_key_number_and_seed():
    """(target of 100 meeting faces, number): made once, and alike when made again."""
    item, again = make_fixture(100, 0), make_fixture.__wrapped__(100, 0)
    assert item is make_fixture(100, 0) and again is not item
    assert np.array_equal(item.motion.translations, again.motion.translations)
    assert np.array_equal(item.pairs, again.pairs)
    assert [body.mesh.content_hash for body in item.bodies] == [body.mesh.content_hash for body in again.bodies]
    assert all(len(body.mesh.faces) < 600 for body in item.bodies), "no finer than the target needs"
    moves = [made.motion.translations.tolist() for made in (item, make_fixture(100, 2), make_fixture(100, 0, seed=1))]
    assert moves[0] != moves[1] != moves[2] != moves[0]


def test_the_meshes_are_closed_at_any_tessellation():
    """Tori and balls of so many sections; the sum over faces is six times a volume, positive if they face outwards."""
    for sections in (8, 9, 25, 60):
        for mesh in (torus(sections), sphere(sections)):
            assert mesh.is_closed
            corners = mesh.triangles
            assert np.einsum("fi,fi->f", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() > 0


def test_face_in_several_pairs_is_counted_once():
    """Faces 0 and 1 of the first body and 5 and 6 of the second."""
    assert faces_of_pairs(np.array([[0, 5], [0, 6], [1, 6]])) == 4
    assert faces_of_pairs(np.zeros((0, 2), dtype=np.int64)) == 0


def test_pose_between_coarse_distances_is_computed(monkeypatch):
    """At none of eight distances of the first direction 98 to 102 faces meet; between two of them they do."""
    monkeypatch.setattr(fixtures, "MOST_DIRECTIONS", 1)
    monkeypatch.setattr(fixtures, "DISTANCES_AT_ONCE", 8)
    fixture_without_its_cache = make_fixture.__wrapped__
    assert abs(fixture_without_its_cache(100, 0).faces - 100) <= TARGET_TOLERANCE * 100
    monkeypatch.setattr(fixtures, "MOST_BRACKETS", 0)  # looks between none of them
    with pytest.raises(FixtureError):
        fixture_without_its_cache(100, 0)


def test_fixture_is_refused_when_no_attempt_finds_a_pose(monkeypatch):
    """No direction is tried."""
    monkeypatch.setattr(fixtures, "MOST_DIRECTIONS", 0)  # gives up before the first pose
    fixture_without_its_cache = make_fixture.__wrapped__
    with pytest.raises(FixtureError, match="in which 100 faces meet; choose a target from 100 to 1000"):
        fixture_without_its_cache(100, 0)
