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
"""(target, number) of fixtures of both families at every target: a pair of 100, and one in nine of all there are."""


def pairs_by_exhaustion(fixture):
    """Face pairs of the two bodies of a fixture that meet, by the test of every face against every other."""
    placed_triangles = [
        place_points(body.mesh.triangles, fixture.motion.rotations[0, k], fixture.motion.translations[0, k])
        for k, body in enumerate(fixture.bodies)
    ]
    return meeting_faces_exhaustive(*placed_triangles)


@pytest.mark.slow
@pytest.mark.parametrize(("target", "number"), [(100, 0), *MORE])
def test_requested_number_of_faces_meets_and_exhaustion_agrees(target, number):
    """A fixture is a pose of two meshes in which ``target`` faces meet, to 2 %, with the face pairs that do.

    Even numbers are of the first family, torus and sphere, odd ones of the second, beaker and flask.
    """
    fixture = make_fixture(target, number)
    assert abs(fixture.faces - target) <= TARGET_TOLERANCE * target
    assert fixture.family == FAMILY_NAMES[number % 2]
    assert np.array_equal(fixture.pairs, pairs_by_exhaustion(fixture))


def test_fixture_is_remembered_and_alike_when_made_again():
    """The pose of number 0 in which 100 faces meet; ``__wrapped__`` makes it without the memory."""
    first, again = make_fixture(100, 0), make_fixture.__wrapped__(100, 0)
    assert first is make_fixture(100, 0)
    assert again is not first
    assert np.array_equal(first.motion.translations, again.motion.translations)
    assert np.array_equal(first.pairs, again.pairs)
    assert [body.mesh.content_hash for body in first.bodies] == [body.mesh.content_hash for body in again.bodies]


def test_fixture_depends_on_number_and_seed():
    """Poses in which 100 faces meet: of number 0, of number 2 (the same meshes), and of number 0 with another seed."""
    fixtures = [make_fixture(100, 0), make_fixture(100, 2), make_fixture(100, 0, seed=1)]
    assert len({fixture.motion.translations.tobytes() for fixture in fixtures}) == 3


def test_meshes_are_no_finer_than_the_target_needs():
    """A pose of torus and sphere in which 100 faces meet takes 256 and 224 faces; the finest torus has 65,536."""
    assert max(len(body.mesh.faces) for body in make_fixture(100, 0).bodies) < 300


@pytest.mark.parametrize("sections", [8, 9, 25, 60])
@pytest.mark.parametrize("make", [torus, sphere])
def test_the_meshes_are_closed_at_any_tessellation(make, sections):
    """The sum of (a, b x c) over faces with corners a, b, c is six times the volume, positive if they face outwards."""
    mesh = make(sections)
    assert mesh.is_closed
    a, b, c = mesh.triangles.transpose(1, 0, 2)
    assert np.einsum("fi,fi->", a, np.cross(b, c)) > 0


def test_face_in_several_pairs_is_counted_once():
    """Three pairs are of faces 0 and 1 of the first body, and 5 and 6 of the second; no pair has no face."""
    assert faces_of_pairs(np.array([[0, 5], [0, 6], [1, 6]])) == 4
    assert faces_of_pairs(np.zeros((0, 2), dtype=np.int64)) == 0


@pytest.fixture
def make_afresh():
    """``make_fixture`` without its memory."""
    return make_fixture.__wrapped__


def test_pose_between_coarse_distances_is_computed(monkeypatch, make_afresh):
    """Bodies part along the first direction only, in eight distances: at none of them 98 to 102 faces meet.

    They do at a distance between two of the eight, one with more than 100 faces and one with fewer ("bracket").
    """
    monkeypatch.setattr(fixtures, "MOST_DIRECTIONS", 1)
    monkeypatch.setattr(fixtures, "DISTANCES_AT_ONCE", 8)
    assert abs(make_afresh(100, 0).faces - 100) <= TARGET_TOLERANCE * 100
    monkeypatch.setattr(fixtures, "MOST_BRACKETS", 0)
    with pytest.raises(FixtureError, match="in which 100 faces meet"):
        make_afresh(100, 0)


def test_fixture_is_refused_when_no_attempt_finds_a_pose(monkeypatch, make_afresh):
    """No direction is tried, so that the search gives up before its first pose."""
    monkeypatch.setattr(fixtures, "MOST_DIRECTIONS", 0)
    with pytest.raises(FixtureError, match="in which 100 faces meet; choose a target from 100 to 1000"):
        make_afresh(100, 0)
