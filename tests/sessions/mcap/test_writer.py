from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from support.mutants import round_trips
from support.second_opinions import read_frames_plainly
from support.session_files import (
    any_frames,
    assert_same_frames,
    protobuf_messages,
    random_frames,
    session_of,
    tetrahedron,
    write_foreign,
)

from sessions.errors import SessionFileError
from sessions.mcap.metadata import (
    FORMAT,
    MESH_HASH,
    collider_file,
    collider_name,
    mesh_file,
    mesh_name,
    session_record,
)
from sessions.mcap.reader import read_session
from sessions.mcap.writer import write_session
from sessions.meshes.glb import mesh_to_glb
from sessions.model.event import Event, Interval, LiveContact
from sessions.model.scene import Scene, SceneBody
from sessions.model.session import Frames, GazeTrack, HandTrack, ScalarTrack, Session, Track
from sessions.scene_files.scene_toml import parse_scene


def full_session():
    """A session with something of every kind that a file can hold."""
    times = np.arange(400, dtype=np.int64) * 1_000_000
    rng = np.random.default_rng(5)
    return session_of(
        random_frames(seed=3, odd=0.1, absent=0.1),
        meshes={"body 0": tetrahedron(), "a/b": tetrahedron(size=1 / 3)},
        scene=Scene(),
        events=(Event(7, "start"), Event(9, "drop: it", "the glass: fell", "body 0", "warning"), Event(9, "a", "a")),
        intervals=(
            Interval(start_ns=1, end_ns=5, kind="task", name="pour", data={"volume": "2", "by": "anna"}),
            Interval(start_ns=1, end_ns=9, kind="stage", name="one"),
        ),
        facts={"vr_type": "immersive", "source_units": "m"},
        hands={"anna/left": HandTrack(
            [1, 2, 9], [0.1, 0.2, 1.0], grip=None, buttons=("a", "menu"), pressed=[[0, 1], [1, 1], [0, 0]])},
        live_contacts=(LiveContact(3, "body 0", "body 1", "enter", (0.5, -0.25, 1e-300)), LiveContact(4, "x", "y", "exit")),  # noqa: E501
        fast_tracks={"body 1": Track(times, rng.normal(size=(400, 3)), rng.normal(size=(400, 4)), times % 3_000_000 > 0)},  # noqa: E501
        gaze={"anna": GazeTrack(times, rng.normal(size=(400, 3)), rng.normal(size=(400, 3)), times % 2 > 0, ["", "cup"] * 200)},  # noqa: E501
        scalars={"EEG/Fz": ScalarTrack(times, np.where(times % 5_000_000, rng.normal(size=400), np.nan), "uV"), "empty": ScalarTrack([3], [1])},  # noqa: E501
    )  # fmt: skip


def test_session_survives_its_file_and_rewrites_to_same_bytes(tmp_path):
    """A session with something of every kind is written to written.mcap and read again: nothing is lost.

    Written again, and made and written anew, it has the same bytes.
    """
    session = full_session()
    round_trips(session, tmp_path)
    session_of_file = read_session(tmp_path / "written.mcap")
    assert_same_frames(session_of_file.frames, session.frames)
    assert session_of_file.facts.items() >= session.facts.items()
    assert session_of_file.facts["format"] == "vrlab/1"
    assert tuple(session_of_file.live_contacts) == session.live_contacts
    assert list(session_of_file.fast_tracks) == ["body 1"]
    assert [mesh_to_glb(mesh, name) for name, mesh in session_of_file.meshes.items()] == [
        mesh_to_glb(mesh, name) for name, mesh in session.meshes.items()
    ]
    for equal_session in (session_of_file, full_session()):
        write_session(equal_session, tmp_path / "rewritten.mcap", overwrite=True)
        assert (tmp_path / "rewritten.mcap").read_bytes() == (tmp_path / "written.mcap").read_bytes()


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(any_frames())
def test_frames_round_trip_bit_for_bit_as_with_protobuf(tmp_path, frames):
    """Random frames, read by this package and by a plain loop over protobuf, of our file and of a foreign one."""
    path = tmp_path / "s.mcap"
    write_session(session_of(frames), path)
    assert_same_frames(read_session(path).frames, frames)
    assert_same_frames(read_frames_plainly(path, frames.names), frames)
    foreign = write_foreign(tmp_path / "f.mcap", protobuf_messages(frames))
    assert_same_frames(read_session(foreign).frames, read_frames_plainly(foreign))


class Ragged:
    """The same frames in blocks of any length."""

    def __init__(self, frames: Frames, cuts):
        self.names, self._frames, self._cuts = frames.names, frames, [0, *cuts, len(frames)]

    def blocks(self, frames):
        for start, stop in zip(self._cuts, self._cuts[1:], strict=False):
            yield self._frames.segment(start, stop)


def test_bytes_do_not_depend_on_block_sizes(tmp_path):
    """A session of 4,000 frames comes in one block, or is cut after frames 1, 2, 700 and 3,999: both give one file."""
    frames = random_frames(seed=8, count=4000, bodies=6, odd=0.05)
    write_session(session_of(frames), tmp_path / "a.mcap")
    write_session(Session(Ragged(frames, [1, 2, 700, 3999]), {}), tmp_path / "b.mcap")
    assert (tmp_path / "a.mcap").stat().st_size > 1_000_000  # many chunks, which are of some 100 kB
    assert (tmp_path / "a.mcap").read_bytes() == (tmp_path / "b.mcap").read_bytes()


def test_a_stamp_before_zero_is_refused_and_leaves_no_file(tmp_path):
    """All frames are at -5 ns, or, in a second session, an event is at -1 ns."""
    frames = random_frames(seed=0)
    early = Frames(
        frames.names,
        frames.stamp_ns * 0 - 5,
        *(getattr(frames, name) for name in ("log_ns", "sample_ns", "position", "quaternion_xyzw", "status")),
    )
    with pytest.raises(SessionFileError, match=r"-5 ns.*shift all stamps"):
        write_session(session_of(early), tmp_path / "s.mcap")
    with pytest.raises(SessionFileError, match="-1 ns"):
        write_session(session_of(frames, events=(Event(-1, "x"),)), tmp_path / "s.mcap")
    assert list(tmp_path.iterdir()) == []


SCENE = """# a bench, as its author wrote it
[[body]]
id = "body 0"
tags = ["glass"]
"""


def test_scene_text_survives_and_changed_scene_gets_new_text(tmp_path):
    """A file has the author's text of a scene as long as it says the same; one more body makes a new text.

    So does a scene of which there was no text.
    """
    scene = parse_scene(SCENE)
    changed = replace(scene, bodies=(*scene.bodies, SceneBody("cup", shape="sphere", size={"radius": 0.1})))
    for written, has_text_of_author in ((scene, True), (changed, False), (replace(changed, text=""), False)):
        write_session(session_of(random_frames(seed=0), scene=written), tmp_path / "s.mcap")
        result = read_session(tmp_path / "s.mcap").scene
        assert replace(result, text="") == replace(written, text="")
        assert (result.text == SCENE) == has_text_of_author


def test_rewritten_file_states_itself_and_its_meshes_anew():
    """Facts about the older file's format and mesh hashes are left out."""
    assert session_record({FORMAT: "older", f"{MESH_HASH}a": "0"}, {}) == session_record({}, {})


def test_attachments_of_meshes_and_colliders_name_their_body():
    """The file names of the mesh, and of collider 12, of a body "a/b" give it back; other names give nothing."""
    assert mesh_name(mesh_file("a/b")) == "a/b"
    assert mesh_name("scene.toml") is None
    assert collider_name(collider_file("a/b", 12)) == ("a/b", 12)
    assert collider_name(mesh_file("a/b")) is None
