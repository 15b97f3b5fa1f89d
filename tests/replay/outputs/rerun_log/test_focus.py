"""The close-up stands before the nearest miss wherever the cursor goes."""

from dataclasses import replace

import numpy as np
import pytest

from cdcore.transforms.rigid import rotation_from_quaternion
from replay.comparison.outcome import Outcome
from replay.errors import RunFolderError
from replay.outputs.camera import CLOSE_UP
from replay.outputs.moments import key_moments
from replay.outputs.rerun_log import overview
from replay.outputs.rerun_log.overview import moment_eyes, read_moments
from replay.outputs.rerun_log.recording import write_recording

SUBJECT = "22.5Hz"


def misses_in(recording):
    return {one.number: one.session_ns for one in read_moments(recording) if one.kind == "miss"}


@pytest.mark.parametrize("space", ["world/missed", "world/focus"])
def test_where_the_cursor_meets_a_miss_the_eye_looks_at_it(demo, read, recording, space):
    places = misses_in(recording)
    shared = [miss.deepest for miss in demo.misses[SUBJECT]]
    assert len(set(shared)) < len(shared)
    for miss in demo.misses[SUBJECT]:
        place = np.array(read.at_ns(f"{space}/eye", "Transform3D:translation", places[miss.number])[0])
        q = np.array(read.at_ns(f"{space}/eye", "Transform3D:quaternion", places[miss.number])[0])
        assert np.allclose(place - CLOSE_UP * rotation_from_quaternion(q)[:, 2], miss.point, atol=1e-5)


def test_beyond_the_counted_ones_every_miss_still_has_its_eye(demo, monkeypatch):
    moments = [one for one in key_moments(demo) if one.outcome == Outcome.MISSED]
    whole, hiding = moment_eyes(demo, moments)
    monkeypatch.setattr(overview, "COUNTED", 1)
    few, less = moment_eyes(demo, moments)
    assert [*few] == [*whole] == moments and less <= hiding
    longest = max(moments, key=lambda one: one.size)
    assert few[longest] == whole[longest] and any(few[one] != whole[one] for one in moments)
    for one in moments:
        assert np.linalg.norm(np.subtract(few[one].position, one.point)) == pytest.approx(CLOSE_UP)


def test_misses_read_back_with_the_nanosecond_of_their_deepest_frame(demo, recording):
    stamps = demo.assembly.stamp_ns - demo.assembly.stamp_ns[0]
    found = [one for one in key_moments(demo) if one.outcome == Outcome.MISSED]
    assert misses_in(recording) == {one.number: int(stamps[one.frame]) + one.later for one in found}
    deepest = {miss.number: int(stamps[miss.deepest]) for miss in demo.misses[SUBJECT]}
    assert all(0 <= ns - deepest[number] < 100 for number, ns in misses_in(recording).items())


def test_a_recording_without_misses_has_none(demo, tmp_path):
    write_recording(replace(demo, misses={"22.5Hz": ()}), tmp_path / "none.rrd")
    assert misses_in(tmp_path / "none.rrd") == {}


@pytest.mark.parametrize("content", [b"", b"not a recording"])
def test_a_file_that_is_no_recording_is_one_sentence(tmp_path, content):
    (tmp_path / "run.rrd").write_bytes(content)
    with pytest.raises(RunFolderError, match=r"run\.rrd cannot be read as a recording"):
        read_moments(tmp_path / "run.rrd")
