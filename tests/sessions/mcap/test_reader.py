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
    [{"compression": CompressionType.LZ4}, {"compression": CompressionType.NONE}, {"use_chunking": False}, BARE],
)
def test_any_compression_is_read_with_or_without_chunks_and_index(tmp_path, options):
    """200 frames of a foreign file, beside a plain loop over its messages."""
    messages = protobuf_messages(random_frames(seed=2, count=200, bodies=5, absent=0.3))
    path = write_foreign(tmp_path / "f.mcap", messages, chunk_size=1 << 14, **options)
    assert_same_frames(read_session(path).frames, read_frames_plainly(path))
    assert len(read_session(path).frames) == 200


def test_foreign_file_is_identified_and_needs_poses(tmp_path):
    """A file of poses of three bodies by another program states no handedness; one of log messages is refused."""
    path = write_foreign(tmp_path / "f.mcap", protobuf_messages(random_frames(seed=2)))
    session = read_session(path)
    assert session.facts["profile"] == "none" and session.facts["handedness"] == "not stated"
    assert session.names == ("body 0", "body 1", "body 2") and session.events == ()
    log = Log(message="hello", name="node", file="main.cpp")
    spec_file = write_foreign(tmp_path / "g.mcap", [(5, 6, log.SerializeToString())], topic="/log")
    with pytest.raises(SessionFileError, match="no poses"):
        read_session(spec_file)


def test_stream_is_decoded_once_on_first_use(tmp_path, monkeypatch):
    """Names of scalars are known without decoding; ``requested``: the streams that were decoded."""
    heart, requested = ScalarTrack([1, 2], [70, 71]), []
    write_session(session_of(random_frames(seed=1), scalars={"heart": heart}), tmp_path / "s.mcap")
    monkeypatch.setattr(annotations, "read_stream", lambda prefix, _: requested.append(prefix) or heart)
    scalars = read_session(tmp_path / "s.mcap").scalars
    assert [*scalars] == ["heart"] and "heart" in scalars and "pulse" not in scalars and requested == []
    assert scalars["heart"] is scalars["heart"] is heart and requested == ["/scalars/"]


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
    """The byte in the middle of the file is inverted."""
    damaged(session_file, session_file.stat().st_size // 2)
    with pytest.raises(SessionFileError, match=r"chunk at byte \d+ is damaged.*replay recover"):
        _ = read_session(session_file).frames


def test_poses_missing_in_the_chunk_index_are_read(session_file):
    """All message indexes of channel 1, the poses, are taken out of the file."""
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
    """The file is written with a hash of zeros for its mesh."""
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
    """Versions before (0) and after (2) this program's, and one that is no number."""
    path = write_foreign(tmp_path / "f.mcap", protobuf_messages(random_frames(seed=2)), profile=profile)
    with pytest.raises(SessionFileError, match=f"profile '{profile}' and this program reads 'vrlab/1'.*{text}"):
        read_session(path)


def test_two_worlds_are_refused_and_first_duplicate_pose_counts(tmp_path):
    """Poses in "world" and then in "room" are refused.

    A message that holds each body twice is read, with the first pose.
    """
    frames = random_frames(seed=2)
    two = protobuf_messages(frames)[:1] + protobuf_messages(frames, parent="room")[1:]
    with pytest.raises(SessionFileError, match=r"parents 'world' and 'room'.*one frame"):
        read_session(write_foreign(tmp_path / "f.mcap", two))
    publish, log, payload = protobuf_messages(frames)[0]
    other = protobuf_messages(frames)[1][2]
    path = write_foreign(tmp_path / "f.mcap", [(publish, log, payload + other)])
    assert_same_frames(read_session(path).frames, frames.segment(0, 1))
    (result,) = {item.message for item in examine(path) if item.code == "duplicate-stamps"}
    assert result == "1 frames hold two samples of it; the first was taken"


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
    """Sessions of 6,000 and of 60,000 frames; peak memory in KiB, by a process of its own."""
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
    assert peaks[1] - peaks[0] < 8 * 1024  # 20 MB more would be one chunk kept in ten
