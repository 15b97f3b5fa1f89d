"""One call makes fixtures, measures once, and fills every table; a calibration of other options is refused."""

import pytest

from replay.studies.paper.calibration import CalibrationError, write_calibration
from replay.studies.paper.experiment import FULL, QUICK, run_paper
from replay.studies.paper.pictures import PICTURES


@pytest.mark.slow
def test_every_table_is_there_once_and_names_the_options(small):
    keys = [one.key for one in small.tables]
    assert set(keys) == set(PICTURES) and len(set(keys)) == len(keys)
    assert small.experiment == {"targets": [100], "poses": 2, "seed": 0, "near": 40, "sessions": 1}
    assert small.hard == sum(one.hard for one in small.fixtures)
    assert all(len(row) == len(one.head) for one in small.tables for row in one.rows)


@pytest.mark.slow
def test_a_calibration_of_other_options_is_refused_before_any_work(small, tmp_path):
    write_calibration(small.calibration, tmp_path / "one.json")
    with pytest.raises(CalibrationError, match="use the same options"):
        run_paper(targets=(100,), poses=3, near=40, calibration=tmp_path / "one.json")


def test_full_is_table_1_with_20_poses_and_1000_near_ones():
    assert (FULL.targets[0], FULL.targets[-1], len(FULL.targets), FULL.poses, FULL.near) == (100, 1000, 10, 20, 1000)
    assert set(QUICK.targets) < set(FULL.targets)
