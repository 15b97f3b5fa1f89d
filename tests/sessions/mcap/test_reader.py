import subprocess
import sys

import pytest
from foxglove_schemas_protobuf.Log_pb2 import Log
from mcap.opcode import Opcode
from mcap.writer import CompressionType
from support.mutants import with_records
from support.processes import environment
from support.second_opinions import read_frames_plainly
from support.session_files import (
    assert_same_frames,
    protobuf_messages,
    random_frames,
    session_of,
    tetrahedron,
    write_foreign,
)

from sessions import ScalarTrack, examine, read_session, write_session
from sessions.errors import SessionFileError, TornFileError
from sessions.mcap import annotations
from sessions.model.session import Session

BARE = {"use_statistics": False, "repeat_channels": False, "repeat_schemas": False, "use_summary_offsets": False}


@pytest.mark.parametrize(
    "options",
    [
        pytest.param({"compression": CompressionType.LZ4}, id="LZ4"),
        pytest.param({"compression": CompressionType.NONE}, id="not compressed"),
        pytest.param({"use_chunking": False}, id="no chunks"),
        pytest.param(BARE, id="no index"),
    ],
)
def test_any_compression_is_read_with_or_without_chunks_and_index(tmp_path, options):
    """Another program's file has 200 frames of five bodies; a plain loop over its messages gives the same frames."""
    messages = protobuf_messages(random_frames(seed=2, count=200, bodies=5, absent=0.3))
    path = write_foreign(tmp_path / "f.mcap", messages, chunk_size=1 << 14, **options)
    assert_same_frames(read_session(path).frames, read_frames_plainly(path))
    assert len(read_session(path).frames) == 200


def test_foreign_file_is_identified(tmp_path):
    """A file of poses of three bodies by another program states no profile and no handedness, and has no events."""
    path = write_foreign(tmp_path / "f.mcap", protobuf_messages(random_frames(seed=2)))
    session = read_session(path)
    assert session.facts["profile"] == "none"
    assert session.facts["handedness"] == "not stated"
    assert session.names == ("body 0", "body 1", "body 2")
    assert session.events == ()


def test_foreign_file_without_poses_is_refused(tmp_path):
    """The file has one message of a log."""
    log = Log(message="hello", name="node", file="main.cpp")
    path = write_foreign(tmp_path / "g.mcap", [(5, 6, log.SerializeToString())], topic="/log")
    with pytest.raises(SessionFileError, match="no poses"):
        read_session(path)


def test_stream_is_decoded_once_on_first_use(tmp_path, monkeypatch):
    """A file has one scalar, "heart", whose name is known before its numbers are decoded; they are decoded once."""
    heart, decoded_prefixes = ScalarTrack([1, 2], [70, 71]), []
    write_session(session_of(random_frames(seed=1), scalars={"heart": heart}), tmp_path / "s.mcap")
    monkeypatch.setattr(annotations, "read_stream", lambda prefix, _: decoded_prefixes.append(prefix) or heart)
    scalars = read_session(tmp_path / "s.mcap").scalars
    assert [*scalars] == ["heart"]
    assert "heart" in scalars
    assert "pulse" not in scalars
    assert decoded_prefixes == []
    assert scalars["heart"] is heart
    assert scalars["heart"] is heart
    assert decoded_prefixes == ["/scalars/"]


def damaged(path, offset, byte=None):
    """Change a byte of a file: all its bits, unless others are given."""
    data = bytearray(path.read_bytes())
    data[offset] ^= 0xFF if byte is None else byte
    path.write_bytes(data)


@pytest.fixture
def session_file(tmp_path):
    """A session of 3,000 frames and six bodies."""
    path = tmp_path / "s.mcap"
    write_session(session_of(random_frames(seed=4, count=3000, bodies=6), meshes={"body 0": tetrahedron()}), path)
    return path


def test_flipped_chunk_byte_is_reported_and_not_read(session_file):
    """The byte in the middle of the file, within one of its chunks, is inverted: the chunk's checksum is wrong then."""
    damaged(session_file, session_file.stat().st_size // 2)
    with pytest.raises(SessionFileError, match=r"chunk at byte \d+ is damaged.*replay recover"):
        _ = read_session(session_file).frames


def test_poses_missing_in_the_chunk_index_are_read(session_file):
    """A file lists the messages of each chunk by channel; the lists of channel 1, the poses, are taken out of it."""
    frames = read_session(session_file).frames
    of_poses = (Opcode.MESSAGE_INDEX, (1).to_bytes(2, "little"))
    session_file.write_bytes(
        with_records(
            session_file.read_bytes(),
            lambda records: [piece for piece in records if (piece[0], piece[1][:2]) != of_poses],
        )
    )
    assert_same_frames(read_session(session_file).frames, frames)


def test_mesh_with_another_hash_is_reported(tmp_path, monkeypatch):
    """The file states a hash of zeros for its mesh, which is not that of the mesh that it has."""
    from sessions.mcap import writer

    class Wrong:
        def hexdigest(self):
            return "0" * 64

    monkeypatch.setattr(writer.hashlib, "sha256", lambda data: Wrong())
    write_session(session_of(random_frames(seed=1), meshes={"body 0": tetrahedron()}), tmp_path / "s.mcap")
    monkeypatch.undo()
    with pytest.raises(SessionFileError, match=r"mesh of 'body 0' is not the one that was recorded"):
        read_session(tmp_path / "s.mcap")


def test_missing_file_and_folder_are_refused_in_a_sentence(tmp_path):
    """A file that does not exist, and the folder in place of a file."""
    with pytest.raises(SessionFileError, match=r"none.mcap.*does not exist.*check the path"):
        read_session(tmp_path / "none.mcap")
    with pytest.raises(SessionFileError, match="is a folder"):
        read_session(tmp_path)


@pytest.mark.parametrize(("profile", "text"), [("vrlab/0", "again"), ("vrlab/2", "newer"), ("vrlab/²", "again")])
def test_unknown_version_is_refused_in_a_sentence(tmp_path, profile, text):
    """This program reads version 1; a file states the version before, the one after, or a sign that is no number."""
    path = write_foreign(tmp_path / "f.mcap", protobuf_messages(random_frames(seed=2)), profile=profile)
    with pytest.raises(SessionFileError, match=f"profile '{profile}' and this program reads 'vrlab/1'.*{text}"):
        read_session(path)


def test_poses_in_two_frames_of_reference_are_refused(tmp_path):
    """The first message has poses in the frame "world", all others in "room"."""
    frames = random_frames(seed=2)
    in_world, in_room = protobuf_messages(frames), protobuf_messages(frames, parent="room")
    with pytest.raises(SessionFileError, match=r"parents 'world' and 'room'.*one frame"):
        read_session(write_foreign(tmp_path / "f.mcap", [*in_world[:1], *in_room[1:]]))


def test_first_of_two_poses_in_a_message_counts(tmp_path):
    """The only message has the poses of frame 0 and behind them those of frame 1; the doctor says so of each body."""
    frames = random_frames(seed=2)
    (publish, log, payload), (_publish, _log, another_payload), *_others = protobuf_messages(frames)
    path = write_foreign(tmp_path / "f.mcap", [(publish, log, payload + another_payload)])
    assert_same_frames(read_session(path).frames, frames.segment(0, 1))
    messages = {finding.message for finding in examine(path) if finding.code == "duplicate-stamps"}
    assert messages == {"1 frames hold two samples of it; the first was taken"}


def test_torn_session_file_is_refused_with_the_recover_command(session_file):
    """Cut after 60 % of its bytes, among the chunks, and after 99.9 %, at its end."""
    data = session_file.read_bytes()
    for fraction in (0.6, 0.999):
        session_file.write_bytes(data[: int(len(data) * fraction)])
        with pytest.raises(TornFileError, match=r"cut short at byte \d+.*replay recover"):
            read_session(session_file)


LONG = """
import sys
from support.processes import peak_bytes
from sessions import read_session
count = sum(len(block) for block in read_session(sys.argv[1]).blocks(1024))
print(count, peak_bytes() // 1024)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="peak memory is measured in KiB of Linux")
def test_block_reading_memory_is_independent_of_session_length(tmp_path):
    """Sessions of 6,000 and of 60,000 frames are read in blocks, each by a process that prints its peak memory in KiB.

    The long session takes at most 8 MB more; 20 MB would be one chunk in ten that is not given back.
    """
    frames = random_frames(seed=1, count=3000, bodies=12)

    class Repeated:
        names = frames.names

        def __init__(self, times):
            self.times = times

        def blocks(self, length):
            for _ in range(self.times):
                yield from frames.blocks(length)

    peaks = []
    for times in (2, 20):
        path = tmp_path / f"{times}.mcap"
        write_session(Session(Repeated(times), {}), path)
        command = [sys.executable, "-c", LONG, str(path)]
        done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment())
        count, peak = map(int, done.stdout.split())
        assert count == 3000 * times
        peaks.append(peak)
    peak_of_short_kib, peak_of_long_kib = peaks
    assert peak_of_long_kib - peak_of_short_kib < 8 * 1024
