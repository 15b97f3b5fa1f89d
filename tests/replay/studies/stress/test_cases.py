"""What is written of a failing pair or scene is read back bit for bit."""

import numpy as np
import pytest
from support.stress_files import read_cases, read_scenes

from replay.errors import OutputError
from replay.studies.stress.cases import Cases, FailedScene, write_cases, write_scenes
from replay.studies.stress.families import FAMILIES
from replay.studies.stress.scenes import grazing, resting


def some(detector="hybrid"):
    triangles = FAMILIES[14].pairs(3)
    verdict = np.array([0, 1, 6], dtype=np.uint8)
    return Cases(detector, 15, 100, 3, np.arange(3), triangles, np.array([True, False, True]), verdict)


def test_what_is_written_is_read_back_bit_for_bit(tmp_path):
    cases = some()
    back = read_cases(write_cases(cases, tmp_path / "new" / "folder"))
    assert [path.suffix for path in (tmp_path / "new" / "folder").iterdir()] == [".npz"], "nothing half written stays"
    assert back.triangles.tobytes() == cases.triangles.tobytes()
    assert (back.detector, back.family, back.seed, back.count) == ("hybrid", 15, 100, 3)
    for name in ("row", "truth", "verdict"):
        assert np.array_equal(getattr(back, name), getattr(cases, name))


def test_the_family_and_seed_of_a_file_make_its_triangles_again(tmp_path):
    back = read_cases(write_cases(some(), tmp_path))
    again = FAMILIES[back.family - 1].pairs(back.count, back.seed)[back.row]
    assert again.tobytes() == back.triangles.tobytes()


def test_the_name_of_a_detector_of_somebody_else_makes_a_file_name(tmp_path):
    assert write_cases(some("lab.engine:Detector"), tmp_path).name == "family-15-lab-engine-detector-seed-100.npz"


def failed():
    scenes = [next(resting(np.random.default_rng(0))), next(grazing(np.random.default_rng(0)))]
    return [FailedScene(scene, np.zeros(len(scene.truth), dtype=np.uint8)) for scene in scenes]


def test_a_failing_scene_is_read_back_bit_for_bit(tmp_path):
    path = write_scenes(failed(), "Hybrid:x", 41, 5, tmp_path / "new")
    assert path.name == "case-41-hybrid-x-seed-5.npz"
    for one, back in zip(failed(), read_scenes(path), strict=True):
        assert (one.scene.name, one.scene.covers) == (back.scene.name, back.scene.covers)
        for name in ("times", "translations", "rotations", "valid", "linked"):
            assert getattr(one.scene.motion, name).tobytes() == getattr(back.scene.motion, name).tobytes()
        for a, b in zip(one.scene.bodies, back.scene.bodies, strict=True):
            assert a.mesh.triangles.tobytes() == b.mesh.triangles.tobytes()
        assert np.array_equal(one.scene.truth, back.scene.truth) and np.array_equal(one.said, back.said)


@pytest.mark.parametrize(
    "write", [lambda out: write_cases(some(), out), lambda out: write_scenes(failed(), "a", 41, 5, out)]
)
def test_a_folder_that_is_a_file_is_one_sentence(tmp_path, write):
    (tmp_path / "taken").write_text("")
    with pytest.raises(OutputError, match="cannot be written"):
        write(tmp_path / "taken")
