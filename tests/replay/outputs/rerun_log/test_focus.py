"""The close-up stands before the nearest miss wherever the cursor goes."""

from dataclasses import replace

import numpy as np
import pytest

from cdcore.transforms.rigid import rotation_from_quaternion
from replay.errors import RunFolderError
from replay.outputs.camera import CLOSE_UP
from replay.outputs.rerun_log import focus as module
from replay.outputs.rerun_log.focus import eyes_of, focus, moments, read_misses
from replay.outputs.rerun_log.recording import write_recording

SUBJECT = "22.5Hz"


def test_where_the_cursor_meets_a_miss_the_eye_looks_at_it(demo, read, recording):
    places = {place.number: place.session_ns for place in read_misses(recording)}
    shared = [miss.deepest for miss in demo.misses[SUBJECT]]
    assert len(set(shared)) < len(shared)
    for miss in demo.misses[SUBJECT]:
        place = np.array(read.at_ns("world/missed/eye", "Transform3D:translation", places[miss.number])[0])
        q = np.array(read.at_ns("world/missed/eye", "Transform3D:quaternion", places[miss.number])[0])
        assert np.allclose(place - CLOSE_UP * rotation_from_quaternion(q)[:, 2], miss.point, atol=1e-5)


def numbers(shown):
    return {(one.frame, one.later): one.miss.number for one in shown}


def test_the_focus_changes_half_way_between_two_misses(demo):
    one, two = demo.misses[SUBJECT][:2]
    a = replace(one, number=1, first=10, last=20, deepest=15)
    b = replace(two, number=2, first=41, last=50, deepest=45)
    assert numbers(focus([a, b])) == {(0, 0): 1, (15, 0): 1, (31, 0): 2, (45, 0): 2}


def test_overlapping_misses_are_both_met_where_the_list_leads(demo):
    one, two = demo.misses[SUBJECT][:2]
    a = replace(one, number=1, first=10, last=60, deepest=50)
    b = replace(two, number=2, first=20, last=30, deepest=25)
    at = numbers(focus([a, b]))
    assert (at[25, 0], at[50, 0]) == (2, 1)


def test_misses_that_are_deepest_in_one_frame_follow_each_other_longest_last(demo):
    one = replace(demo.misses[SUBJECT][0], number=1, cut_length=0.3)
    two = replace(one, number=2, cut_length=0.2)
    three = replace(one, number=3, cut_length=0.1)
    at = numbers(focus([one, two, three]))
    assert [at[one.deepest, later] for later in range(3)] == [3, 2, 1]
    assert moments([one, two, three]) == {3: (one.deepest, 0), 2: (one.deepest, 1), 1: (one.deepest, 2)}


def test_beyond_the_counted_ones_every_miss_still_has_its_eye(demo, monkeypatch):
    whole = eyes_of(demo.assembly, demo.session.scene, demo.misses[SUBJECT])
    monkeypatch.setattr(module, "COUNTED", 1)
    few = eyes_of(demo.assembly, demo.session.scene, demo.misses[SUBJECT])
    assert sorted(few) == sorted(whole) == [miss.number for miss in demo.misses[SUBJECT]]
    for miss in demo.misses[SUBJECT]:
        away = np.subtract(few[miss.number].position, miss.point)
        assert np.linalg.norm(away) == pytest.approx(CLOSE_UP)


def test_misses_read_back_with_the_nanosecond_of_their_deepest_frame(demo, recording):
    stamps, misses = demo.assembly.stamp_ns - demo.assembly.stamp_ns[0], demo.misses["22.5Hz"]
    at = moments(misses)
    assert [(one.number, one.session_ns, one.cut_length) for one in read_misses(recording)] == [
        (miss.number, int(stamps[at[miss.number][0]]) + at[miss.number][1], miss.cut_length) for miss in misses
    ]


def test_a_recording_without_misses_has_none(demo, tmp_path):
    write_recording(replace(demo, misses={"22.5Hz": ()}), tmp_path / "none.rrd")
    assert read_misses(tmp_path / "none.rrd") == []


@pytest.mark.parametrize("content", [b"", b"not a recording"])
def test_a_file_that_is_no_recording_is_one_sentence(tmp_path, content):
    (tmp_path / "run.rrd").write_bytes(content)
    with pytest.raises(RunFolderError, match=r"run\.rrd cannot be read as a recording"):
        read_misses(tmp_path / "run.rrd")
