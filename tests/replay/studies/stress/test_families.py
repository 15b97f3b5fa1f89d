"""Families, solids and flips are what they say: reproducible, closed, hard as their name promises, counted once."""

import numpy as np
import pytest
from support.predicate_work import left_open

from cdcore import Verdict
from cdcore.narrow.triangles.predicates import triangles_intersect
from replay.errors import StressError
from replay.studies.stress.cases import read_cases
from replay.studies.stress.families import FAMILIES, random_rotations, unit_normal
from replay.studies.stress.flips import count_flips, flips_of
from replay.studies.stress.relations import RELATIONS
from replay.studies.stress.solids import ball_mesh, beaker_mesh, box_mesh, icosphere_mesh, merged, moved, rod_mesh

by_name = pytest.mark.parametrize("family", FAMILIES, ids=lambda family: family.name)


def test_there_are_twenty_six_families_numbered_from_one():
    assert [family.number for family in FAMILIES] == list(range(1, 27))
    assert len({family.name for family in FAMILIES}) == 26


@by_name
def test_a_seed_fixes_every_bit_and_another_seed_changes_them(family):
    first, again, other = family.pairs(50), family.pairs(50), family.pairs(50, seed=7)
    assert first.shape == (50, 2, 3, 3)
    assert np.isfinite(first).all()
    assert first.tobytes() == again.tobytes()
    assert first.tobytes() != other.tobytes()


@by_name
def test_where_construction_fixes_the_answer_the_exact_test_gives_it(family):
    answers = triangles_intersect(family.pairs(400))
    if family.expected is not None:
        assert (answers == family.expected).all()
    else:
        assert 0 < answers.sum() < 400, "a family without a fixed answer must hold both answers"


@pytest.mark.parametrize("number", [3, 4, 5, 6, 7, 8, 10, 18, 24])
def test_degenerate_families_are_not_decided_by_the_float_filter_alone(number):
    assert left_open(FAMILIES[number - 1].pairs(400))[0] > 100


def test_the_generic_family_needs_no_exact_arithmetic_and_meets_in_about_28_percent():
    pairs = FAMILIES[0].pairs(20_000)
    assert left_open(pairs) == (0, 0)
    assert abs(triangles_intersect(pairs).mean() - 0.28) < 0.02


def test_points_off_a_face_stand_on_triangles_that_have_a_normal():
    _, length = unit_normal(FAMILIES[10].pairs(400)[:, 0])
    assert (length >= 1e-3).all()


def test_random_rotations_keep_lengths_and_hands():
    turns = random_rotations(np.random.default_rng(0), 30)
    assert np.allclose(turns @ turns.transpose(0, 2, 1), np.eye(3)) and np.allclose(np.linalg.det(turns), 1.0)


def test_only_the_scale_families_are_not_metric():
    assert [family.number for family in FAMILIES if not family.metric] == [14, 15, 16]


def volume(mesh):
    a, b, c = (mesh.triangles[:, k] for k in range(3))
    return np.einsum("nk,nk->n", a, np.cross(b, c)).sum() / 6


@pytest.mark.parametrize(
    "mesh", [box_mesh(), ball_mesh(), beaker_mesh(), rod_mesh(), icosphere_mesh(), merged(box_mesh(), box_mesh())]
)
def test_every_edge_is_run_once_each_way(mesh):
    edges = np.concatenate([mesh.faces[:, [k, (k + 1) % 3]] for k in range(3)]).tolist()
    assert sorted(edges) == sorted([b, a] for a, b in edges)


def test_volumes_are_those_of_the_shapes():
    assert volume(box_mesh((1, 2, 3))) == pytest.approx(6)
    assert volume(moved(box_mesh((1, 2, 3)), [9, 8, 7])) == pytest.approx(6)
    assert volume(ball_mesh(1.0, 64, 64)) == pytest.approx(4 / 3 * np.pi, rel=5e-3)
    assert volume(icosphere_mesh(4)) == pytest.approx(4 / 3 * np.pi, rel=5e-3)
    assert volume(rod_mesh(1.0, 2.0, 400)) == pytest.approx(2 * np.pi, rel=1e-3)


def test_an_icosphere_has_six_faces_at_a_vertex_exactly_on_each_half_axis():
    mesh = icosphere_mesh(1)
    assert len(mesh.faces) == 80
    for axis in (*np.eye(3), *-np.eye(3)):
        (vertex,) = np.flatnonzero((mesh.vertices == axis).all(axis=1))
        assert (mesh.faces == vertex).sum() == 6


def test_exact_flips_nowhere():
    found = count_flips(["exact"], families=[FAMILIES[k] for k in (1, 9, 14, 17, 24)], pairs=25, seed=3)
    assert len(found) == 5 * 5
    assert sum(one.flips + one.refused for one in found) == 0
    assert [one.number for one in found[:5]] == [2, 10, 15, 18, 25]


def test_python_fcl_flips_and_the_file_holds_both_questions_and_both_answers(tmp_path):
    (found,) = count_flips(["hybrid"], {"axes": RELATIONS["axes"]}, families=FAMILIES[9:10], pairs=200, out=tmp_path)
    assert found.flips > 0
    cases = read_cases(tmp_path / "family-10-hybrid-seed-100-axes.npz")
    assert found.file == str(tmp_path / "family-10-hybrid-seed-100-axes.npz")
    assert cases.relation == "axes" and len(cases.row) == 2 * found.flips
    assert (cases.verdict[::2] != cases.verdict[1::2]).all()
    assert np.array_equal(cases.truth[::2], cases.truth[1::2])
    pairs = FAMILIES[9].pairs(200)
    assert np.array_equal(cases.triangles[::2], pairs[cases.row[::2]])
    assert (np.sort(np.abs(cases.triangles[1::2]), axis=-1) == np.sort(np.abs(cases.triangles[::2]), axis=-1)).all()


def test_refusals_are_counted_apart_and_volumes_not_at_all():
    before = np.array([Verdict.CLEAR, Verdict.CONTACT, Verdict.CLEAR, Verdict.CANDIDATE, Verdict.CLEAR], dtype=np.uint8)
    after = np.array([Verdict.CLEAR, Verdict.CLEAR, Verdict.INVALID, Verdict.CLEAR, Verdict.NOT_FOUND], dtype=np.uint8)
    pairs = FAMILIES[0].pairs(5)
    one = flips_of("planted", "swap", FAMILIES[0], 100, (pairs, pairs), (before, after))
    assert (one.flips, one.refused, one.pairs, one.file) == (1, 1, 5, None)


@pytest.mark.parametrize("bad", [{"pairs": 0}, {"seed": -1}])
def test_numbers_that_mean_nothing_are_refused(bad):
    with pytest.raises(StressError, match="give 1 pair or more"):
        count_flips(["exact"], **bad)
