"""A calibration comes back from its file as it was, turns times into budgets, and refuses another experiment."""

import json

import pytest

from replay.studies.paper.calibration import Calibration, CalibrationError, read_calibration, write_calibration

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
