"""In every fixture the wanted number of faces meets, to 2 %; a calibration comes back as it was."""

import json

import numpy as np
import pytest

from cdcore.narrow.brute_force import meeting_faces_exhaustive
from cdcore.numerics import place_points
from replay.studies.paper import fixtures
from replay.studies.paper.calibration import Calibration, CalibrationError, read_calibration, write_calibration
from replay.studies.paper.fixtures import (
    FAMILY_NAMES,
    POSES,
    TARGETS,
    TOLERANCE,
    FixtureError,
    faces_of_pairs,
    fixture,
    sphere,
    table_fixtures,
    torus,
)

FEW = [(100, number) for number in range(4)] + [(300, 0), (300, 1)]
ALL = [(target, number) for target in TARGETS for number in range(POSES)]


def truth_of(one):
    world = [
        place_points(body.mesh.triangles, one.motion.rotations[0, k], one.motion.translations[0, k])
        for k, body in enumerate(one.bodies)
    ]
    return meeting_faces_exhaustive(*world)


def check(target, number):
    one = fixture(target, number)
    assert abs(one.faces - target) <= TOLERANCE * target
    assert one.family == FAMILY_NAMES[number % 2]
    assert np.array_equal(one.pairs, truth_of(one))


@pytest.mark.parametrize(("target", "number"), FEW)
def test_the_wanted_number_of_faces_meets_and_exhaustion_agrees(target, number):
    check(target, number)


@pytest.mark.slow
@pytest.mark.parametrize(("target", "number"), ALL)
def test_all_200_fixtures_of_table_1_hold(target, number):
    check(target, number)


def test_the_same_key_gives_the_same_fixture_and_another_number_or_seed_another():
    one, again = fixture(100, 0), fixture.__wrapped__(100, 0)
    assert one is fixture(100, 0) and again is not one
    assert one.record == again.record
    records = [made.record["poses"] for made in (one, fixture(100, 2), fixture(100, 0, seed=1))]
    assert records[0] != records[1] != records[2] != records[0]


def test_a_record_names_meshes_poses_and_truth():
    record = fixture(100, 1).record
    assert record["family"] == "beaker-flask" and record["pairs"] == len(fixture(100, 1).pairs)
    assert np.array(record["poses"]).shape == (2, 4, 4)
    assert all(len(digest) == 64 for digest in [*record["mesh_sha256"], record["pairs_sha256"]])


def test_a_table_lists_targets_in_order_and_families_in_turn():
    table = table_fixtures((100, 300), poses=2)
    assert [(one.target, one.number) for one in table] == [(100, 0), (100, 1), (300, 0), (300, 1)]
    assert [one.family for one in table] == list(FAMILY_NAMES) * 2


def test_the_meshes_are_closed_at_any_tessellation():
    for sections in (8, 9, 25, 60):
        for mesh in (torus(sections), sphere(sections)):
            assert mesh.is_closed
            corners = mesh.triangles
            assert np.einsum("fi,fi->f", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() > 0


def test_faces_are_counted_once_however_many_pairs_they_belong_to():
    assert faces_of_pairs(np.array([[0, 5], [0, 6], [1, 6]])) == 4
    assert faces_of_pairs(np.zeros((0, 2), dtype=np.int64)) == 0


def test_a_target_that_no_pose_meets_is_refused(monkeypatch):
    monkeypatch.setattr(fixtures, "ATTEMPTS", 0)
    with pytest.raises(FixtureError, match="in which 100 faces meet; choose a target from 100 to 1000"):
        fixture.__wrapped__(100, 0)


EXPERIMENT = {"targets": [100], "poses": 2, "seed": 0}
PACE = {"torus-sphere": {"random": {"50": 1e-7}}}


@pytest.fixture
def calibration():
    seconds = {"hybrid": {"100": [0.002, 0.004]}, "obb": {"100": [0.01, 0.03]}}
    return Calibration(EXPERIMENT, {"cores": 2}, seconds, {"hybrid": {"100": [0, 0]}, "obb": {"100": [300, 500]}}, PACE)


def test_a_budget_is_what_the_row_does_in_that_time(calibration):
    assert [calibration.budget("obb", 100, share) for share in (0.5, 1.0, 2.0)] == [30, 60, 120]
    assert calibration.budget("obb", 100, 1e-9) == 1


def test_operations_take_their_share_of_the_seconds_measured(calibration):
    assert calibration.seconds_of("obb", 100, 20) == pytest.approx(0.001)


def test_seconds_of_all_targets_are_in_order(calibration):
    assert calibration.all_seconds("obb") == [0.01, 0.03]


def test_the_file_gives_back_every_bit(calibration, tmp_path):
    path = tmp_path / "deep" / "calibration.json"
    write_calibration(calibration, path)
    assert read_calibration(path, EXPERIMENT, ("hybrid", "obb")) == calibration
    first = path.read_bytes()
    write_calibration(read_calibration(path, EXPERIMENT, ("hybrid",)), path)
    assert path.read_bytes() == first


def test_another_experiment_an_absent_row_and_other_files_are_refused(calibration, tmp_path):
    path = tmp_path / "calibration.json"
    write_calibration(calibration, path)
    with pytest.raises(CalibrationError, match="use the same options"):
        read_calibration(path, EXPERIMENT | {"seed": 1}, ("hybrid",))
    with pytest.raises(CalibrationError, match="no times of aabb in every pose of 100 faces"):
        read_calibration(path, EXPERIMENT, ("hybrid", "aabb"))
    for text in ("", "[]", "{}", json.dumps({"version": 2, "other": 2}), json.dumps({"version": 1})):
        path.write_text(text)
        with pytest.raises(CalibrationError, match="calibration"):
            read_calibration(path, EXPERIMENT, ("hybrid",))
    with pytest.raises(CalibrationError, match="cannot be read"):
        read_calibration(tmp_path / "absent", EXPERIMENT, ("hybrid",))


@pytest.mark.parametrize(
    "broken", [{"seconds": "none"}, {"seconds": {"obb": {"100": [0.01]}}}, {"seconds": {"obb": {"100": [0.0, 1.0]}}},
               {"operations": {}}, {"seconds": {"obb": {"100": [float("nan"), 1.0]}}}, {"seconds": {"obb": 3}}],
)  # fmt: skip
def test_a_damaged_file_is_refused_in_one_sentence(calibration, tmp_path, broken):
    path = tmp_path / "calibration.json"
    write_calibration(calibration, path)
    path.write_text(json.dumps(json.loads(path.read_text()) | broken))
    with pytest.raises(CalibrationError, match="leave it out to measure anew"):
        read_calibration(path, EXPERIMENT, ("obb",))
