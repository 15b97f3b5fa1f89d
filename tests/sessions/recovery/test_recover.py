import hashlib
import re

import numpy as np
import pytest
from mcap.opcode import Opcode
from support.damage import chunks, flipped, records
from support.mcap_samples import (
    assert_same_frames,
    protobuf_messages,
    random_frames,
    session_of,
    tetrahedron,
    write_foreign,
)

from sessions import Event, examine, read_session, write_session
from sessions.errors import SessionFileError
from sessions.model.frames import Frames
from sessions.recovery.recover import RECOVERED, recover

COUNT = 1800


def frames_of(path):
    return Frames.join(list(read_session(path).blocks(4096)))


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """20 s at 90 Hz of six bodies with a mesh, a scene's worth of facts and an event."""
    return written(tmp_path_factory.mktemp("whole") / "s.mcap", COUNT)


def written(path, count):
    frames = random_frames(1, count, 6, absent=0.05, odd=0.05)
    event = Event(int(frames.stamp_ns[7]), "grasp", "takes a beaker", "body 1")
    write_session(session_of(frames, meshes={"body 1": tetrahedron()}, events=[event], facts={"pseudonym": "S1"}), path)
    return path


def damaged(tmp_path, data):
    path = tmp_path / "damaged.mcap"
    path.write_bytes(data)
    return path


def test_a_whole_file_comes_back_whole_and_nothing_is_said_to_be_lost(whole, tmp_path):
    before = whole.read_bytes()
    result = recover(whole, tmp_path / "out.mcap")
    assert result.whole and result.frames == COUNT
    assert whole.read_bytes() == before
    assert_same_frames(frames_of(tmp_path / "out.mcap"), frames_of(whole))
    session, again = read_session(whole), read_session(tmp_path / "out.mcap")
    assert list(again.events) == list(session.events) and again.facts["pseudonym"] == "S1"
    assert np.array_equal(again.meshes["body 1"].vertices, session.meshes["body 1"].vertices)
    codes = {finding.code for finding in examine(tmp_path / "out.mcap")}
    assert not codes & {"torn", "damaged-chunk"}


def test_a_damaged_chunk_says_how_many_messages_it_had_and_when_and_so_do_the_facts_of_the_new_file(whole, tmp_path):
    data = whole.read_bytes()
    start, end = chunks(data)[4]
    result = recover(damaged(tmp_path, flipped(data, end - 40, end, 5, 0)), tmp_path / "out.mcap")
    (lost,) = result.lost
    words = re.fullmatch(rf"lost (\d+) messages, (\S+) s to (\S+) s: the chunk at byte {start} is damaged", lost)
    count, first, last = map(float, words.groups())
    truth = frames_of(whole)
    at = (truth.log_ns - truth.log_ns[0]) / 1e9
    inside = int(((at >= first - 5e-4) & (at <= last + 5e-4)).sum())
    assert result.frames == COUNT - inside and count >= inside > 0
    assert lost in read_session(tmp_path / "out.mcap").facts[RECOVERED]


def test_a_file_cut_anywhere_keeps_all_but_the_torn_chunks_rest_and_no_frame_is_another(whole, tmp_path):
    data, truth = whole.read_bytes(), frames_of(whole)
    spans, out = chunks(data), tmp_path / "out.mcap"
    for place in [*np.random.default_rng(2).integers(0, len(data), 6).tolist(), *(end for _, end in spans[2:5])]:
        complete = [end for _, end in spans if end <= place]
        try:
            result = recover(damaged(tmp_path, data[:place]), out, overwrite=True)
        except SessionFileError:
            assert not complete
            continue
        assert result.frames >= min(COUNT, 150 * (len(complete) - 2)), place
        kept = read_session(out).frames
        assert len(kept) == result.frames
        if len(kept):
            assert_same_frames(kept, truth.part(0, len(kept)))


def test_a_mesh_that_changed_is_lost_and_everything_else_is_not(whole, tmp_path):
    data = whole.read_bytes()
    start, end = next((start, end) for opcode, start, end in records(data) if opcode == Opcode.ATTACHMENT)
    result = recover(damaged(tmp_path, flipped(data, start + 80, end, 3, 0)), tmp_path / "out.mcap")
    assert result.lost == ("lost attachments: meshes/body 1.glb",) and result.frames == COUNT
    assert "body 1" not in read_session(tmp_path / "out.mcap").meshes


@pytest.mark.parametrize("opcode", [Opcode.HEADER, Opcode.SCHEMA, Opcode.CHANNEL, Opcode.METADATA])
def test_a_damaged_head_costs_no_frame_because_the_index_repeats_it(whole, tmp_path, opcode):
    data = whole.read_bytes()
    start, end = next((start, end) for found, start, end in records(data) if found == opcode)
    result = recover(damaged(tmp_path, flipped(data, start + 9, end, 4, 1)), tmp_path / "out.mcap")
    assert result.frames == COUNT


def test_bodies_without_a_pose_are_named(tmp_path):
    frames = random_frames(2, 20, 2)
    session = session_of(frames)
    write_session(session, tmp_path / "s.mcap")
    from sessions.mcap_format.metadata import bodies_record

    data = (tmp_path / "s.mcap").read_bytes()
    listed = bodies_record(("body 0", "body 1"))["names"].encode()
    assert data.count(listed) == 1
    path = damaged(tmp_path, data.replace(listed, bodies_record(("body 0", "body 9"))["names"].encode()))
    result = recover(path, tmp_path / "out.mcap")
    assert result.lost == ("no pose is left of: body 9",)
    assert set(read_session(tmp_path / "out.mcap").names) == {"body 0", "body 1", "body 9"}


def test_a_file_of_another_program_is_saved_with_its_own_channels(tmp_path):
    frames = random_frames(3, 200, 2)
    path = write_foreign(tmp_path / "f.mcap", protobuf_messages(frames), chunk_size=4096)
    data = path.read_bytes()
    start, end = chunks(data)[3]
    result = recover(damaged(tmp_path, flipped(data, (start + end) // 2, end, 5, 0)), tmp_path / "out.mcap")
    assert 150 < result.frames < 200
    assert read_session(tmp_path / "out.mcap").facts["format"] == "foreign"


@pytest.mark.parametrize(
    "data, words", [(b"", "it is empty"), (b"hello", "not an MCAP"), (b"\x89MCAP0\r\n", "no chunk")]
)
def test_where_there_is_nothing_to_save_it_says_why_and_writes_nothing(tmp_path, data, words):
    with pytest.raises(SessionFileError, match=words):
        recover(damaged(tmp_path, data), tmp_path / "out.mcap")
    assert not (tmp_path / "out.mcap").exists()


def test_without_a_checksum_poses_that_are_none_are_left_out(tmp_path):
    messages = protobuf_messages(random_frames(3, 200, 2))
    messages[7] = (*messages[7][:2], b"\xff" + messages[7][2][1:])
    path = write_foreign(tmp_path / "f.mcap", messages, enable_crcs=False)
    result = recover(path, tmp_path / "out.mcap")
    assert result.frames == 199 and not result.whole


def test_the_damaged_file_is_not_overwritten(whole, tmp_path):
    digest = hashlib.sha256(whole.read_bytes()).hexdigest()
    with pytest.raises(SessionFileError, match="the damaged file itself"):
        recover(whole, whole, overwrite=True)
    assert hashlib.sha256(whole.read_bytes()).hexdigest() == digest
    with pytest.raises(SessionFileError, match="does not exist"):
        recover(tmp_path / "none.mcap", tmp_path / "new.mcap")


def test_a_file_that_was_never_closed_may_miss_what_came_after_its_last_frame(whole, tmp_path):
    data = whole.read_bytes()
    end = chunks(data)[-1][1]
    result = recover(damaged(tmp_path, data[:end]), tmp_path / "out.mcap")
    seconds = (result.last_ns - result.first_ns) / 1e9
    assert result.frames == COUNT and len(result.lost) == 1
    words = f"it was never closed: what was recorded after {seconds:.3f} s, the last frame kept, may be missing"
    assert result.sentences()[-1] == words and words in read_session(tmp_path / "out.mcap").facts[RECOVERED]
    first = recover(damaged(tmp_path, data[: chunks(data)[0][0]]), tmp_path / "none.mcap")
    assert first.sentences()[-1] == "it was never closed: what was recorded after this may be missing"
