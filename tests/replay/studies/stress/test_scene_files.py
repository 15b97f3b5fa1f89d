"""A failing scene is read back bit for bit; a file that is none is one sentence."""

import numpy as np
import pytest

from replay.errors import OutputError, StressError
from replay.studies.stress.crossings import grazing
from replay.studies.stress.scene_files import FailedScene, read_scenes, write_scenes
from replay.studies.stress.scenes import resting


def failed():
    scenes = [next(resting(np.random.default_rng(0))), next(grazing(np.random.default_rng(0)))]
    return [FailedScene(scene, np.zeros(len(scene.truth), dtype=np.uint8)) for scene in scenes]


def test_what_is_written_is_read_back_bit_for_bit(tmp_path):
    path = write_scenes(failed(), "Hybrid:x", 41, 5, tmp_path / "new")
    assert path.name == "case-41-hybrid-x-seed-5.npz"
    for one, back in zip(failed(), read_scenes(path), strict=True):
        assert (one.scene.name, one.scene.covers) == (back.scene.name, back.scene.covers)
        for name in ("times", "translations", "rotations", "valid", "linked"):
            assert getattr(one.scene.motion, name).tobytes() == getattr(back.scene.motion, name).tobytes()
        for a, b in zip(one.scene.bodies, back.scene.bodies, strict=True):
            assert a.mesh.triangles.tobytes() == b.mesh.triangles.tobytes()
        assert np.array_equal(one.scene.truth, back.scene.truth) and np.array_equal(one.said, back.said)


def test_a_folder_that_is_a_file_and_a_file_that_is_none_are_one_sentence(tmp_path):
    (tmp_path / "taken").write_text("")
    with pytest.raises(OutputError, match="give another folder with --out"):
        write_scenes(failed(), "a", 41, 5, tmp_path / "taken")
    for content in (b"", b"PK\x03\x04 torn"):
        (tmp_path / "x.npz").write_bytes(content)
        with pytest.raises(StressError, match="give a file that replay stress wrote"):
            read_scenes(tmp_path / "x.npz")
