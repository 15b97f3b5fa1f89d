from pathlib import Path

import pytest
from support.mcap_samples import assert_same_frames, random_frames, tetrahedron

from sessions.errors import MeshFileError, SessionFileError
from sessions.mcap_format.annotations import event_message
from sessions.mcap_format.reader import read_session
from sessions.mcap_format.recording_file import RecordingFile
from sessions.model.event import Event
from sessions.model.frames import Frames
from sessions.model.scene import Scene, SceneBody


def opened(path: Path, scene=None, **options):
    options = {"overwrite": False} | options
    return RecordingFile(path, scene or Scene(), {"a": tetrahedron()}, {"vr_type": "desktop"}, **options)


def test_after_every_call_all_of_it_is_readable_from_the_partial_file(tmp_path):
    frames = random_frames(1, 90, 3, odd=0.3)
    file = opened(tmp_path / "s.mcap")
    assert read_session(file.partial, torn="keep").facts["vr_type"] == "desktop"
    for number, part in enumerate(frames.blocks(30), start=1):
        file.write(part, [(5, event_message(Event(number, "tick")))])
        session = read_session(file.partial, torn="keep")
        assert_same_frames(session.frames, frames.part(0, 30 * number))
        assert [event.time_ns for event in session.events] == list(range(1, number + 1))
    file.finish()
    assert_same_frames(read_session(tmp_path / "s.mcap").frames, frames)
    assert not file.partial.exists()


def test_new_bodies_are_listed_when_they_come(tmp_path):
    file = opened(tmp_path / "s.mcap")
    for bodies in (1, 3):
        file.write(random_frames(bodies, 5, bodies), [])
    file.write(Frames.empty(()), [])
    file.finish()
    assert read_session(tmp_path / "s.mcap").names == ("body 0", "body 1", "body 2")


def test_what_cannot_begin_leaves_nothing_behind(tmp_path):
    with pytest.raises(SessionFileError, match="cannot be said in TOML"):
        opened(tmp_path / "s.mcap", scene=Scene(bodies=(SceneBody("a", extra={"unheard": 1}),)))
    assert list(tmp_path.iterdir()) == []
    with pytest.raises((SessionFileError, MeshFileError)):
        opened(tmp_path / "no folder" / "s.mcap")
