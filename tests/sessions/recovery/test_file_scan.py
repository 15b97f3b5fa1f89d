import io

import pytest
from mcap.opcode import Opcode
from mcap.records import Channel
from support.damage import records
from support.mcap_samples import protobuf_messages, random_frames, session_of, tetrahedron

from sessions import write_session
from sessions.mcap_format.catalogue import Region
from sessions.mcap_format.record_block import RecordBlock
from sessions.mcap_format.unpacking import listed
from sessions.recovery.file_scan import Declared, guess_channels, survey


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    path = tmp_path_factory.mktemp("survey") / "s.mcap"
    write_session(session_of(random_frames(1, 900, 3, odd=0.2), meshes={"a": tetrahedron()}), path)
    return path


def test_a_whole_file_is_known_completely(path):
    with path.open("rb") as stream:
        found = survey(path, stream)
    assert (found.frames, found.lost, found.bytes_skipped) == (900, [], 0)
    assert set(found.names) == {"body 0", "body 1", "body 2"}
    assert list(found.attachments) == ["meshes/a.glb"] and found.checked == {"meshes/a.glb"}
    assert {channel.topic for channel in found.declared.raw[Channel].values()} == {"/tf", "/tracking", "/scene"}


def test_a_checked_index_overrules_a_damaged_head(path):
    data = bytearray(path.read_bytes())
    start, end = next((a, b) for opcode, a, b in records(bytes(data)) if opcode == Opcode.CHANNEL)
    at = bytes(data).index(b"/tf", start, end)
    data[at : at + 3] = b"/xx"
    found = survey(path, io.BytesIO(bytes(data)))
    assert found.frames == 900


def test_poses_and_validity_are_guessed_and_nothing_else(path):
    frames = random_frames(1, 3, 2)
    messages = [(7, 0, log, publish, payload) for publish, log, payload in protobuf_messages(frames)]
    messages.append((8, 0, 1, 1, b"hello"))
    block = RecordBlock.of(messages)
    declared = Declared(path)
    guess_channels(listed(block.data, Region(0, 0, "", 0, 0, None), declared), declared)
    assert declared.ids("/tf") == {7} and 8 not in declared.channels
