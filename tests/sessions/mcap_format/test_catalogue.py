import io
import struct

import pytest
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader
from support.mcap_samples import protobuf_messages, random_frames, session_of, tetrahedron, write_foreign

from sessions.errors import SessionFileError
from sessions.mcap_format import catalogue as module
from sessions.mcap_format.catalogue import read_catalogue
from sessions.mcap_format.container import MAGIC, ContainerWriter
from sessions.mcap_format.writer import write_session


@pytest.fixture
def path(tmp_path):
    write_session(session_of(random_frames(1, 3000, 6), meshes={"a": tetrahedron()}), tmp_path / "s.mcap")
    return tmp_path / "s.mcap"


def test_everything_is_found_where_it_lies(path):
    found = read_catalogue(path)
    assert found.profile == "vrlab/1" and found.tear is None
    assert {channel.topic for channel in found.channels.values()} == {"/tf", "/tracking", "/scene"}
    channels = [sorted(region.channels) for region in found.regions]
    assert channels[0] == [3] and len(channels) > 2 and set(map(tuple, channels[1:])) == {(1,)}
    assert list(found.attachments) == ["meshes/a.glb"]
    assert [name for name, _ in found.metadata] == ["vrlab.session", "vrlab.bodies"]
    assert found.metadata_record("none") is None


def test_a_chunk_without_a_message_index_may_hold_anything(tmp_path):
    from mcap.writer import IndexType

    path = write_foreign(tmp_path / "f.mcap", protobuf_messages(random_frames(1)), index_types=IndexType.NONE)
    assert [region.channels for region in read_catalogue(path).regions] == [None]


def test_the_tear_is_at_the_first_record_that_is_not_whole(path):
    data = path.read_bytes()
    chunk = read_catalogue(path).regions[1]
    path.write_bytes(data[: chunk.offset + 10])
    torn = read_catalogue(path)
    assert len(torn.regions) == 1 and chunk.offset - 64 < torn.tear < chunk.offset
    path.write_bytes(data[:-1])
    assert read_catalogue(path).tear is not None


@pytest.mark.parametrize(("kind", "limit"), [("chunk", "CHUNK_LIMIT_BYTES"), ("attachment", "ATTACHMENT_LIMIT_BYTES"),
                                             ("header", "SMALL_RECORD_BYTES")])  # fmt: skip
def test_what_declares_more_than_is_allowed_is_refused_before_it_is_read(path, monkeypatch, kind, limit):
    monkeypatch.setattr(module, limit, 5)
    with pytest.raises(SessionFileError, match=rf"a {kind} record declares \d+ bytes, more than the 5"):
        read_catalogue(path)


def record(opcode, content):
    return struct.pack("<BQ", opcode, len(content)) + content


@pytest.mark.parametrize(
    "content",
    [
        record(1, b"\xff\xff\xff\xff"),  # a header whose text is longer than it
        record(3, b"\x01\x00\x01\x00\x00\x00\xff"),  # a schema whose name is no text
        record(6, b"short"),
        record(6, struct.pack("<QQQII", 0, 0, 5, 0, 1 << 30)),  # a compression with an endless name
        record(6, struct.pack("<QQQII", 0, 0, 5, 0, 0) + struct.pack("<Q", 1 << 40)),  # data beyond the record
        record(9, b"short"),
        record(9, struct.pack("<QQI", 0, 0, 1 << 31)),
    ],
)
def test_a_damaged_record_is_one_sentence(tmp_path, content):
    path = tmp_path / "f.mcap"
    path.write_bytes(MAGIC + content + bytes(100))
    with pytest.raises(SessionFileError, match="damaged"):
        read_catalogue(path)


def test_a_record_that_says_it_is_endless_is_a_tear_and_not_an_allocation(tmp_path):
    path = tmp_path / "f.mcap"
    path.write_bytes(MAGIC + struct.pack("<BQ", 6, 2**63) + bytes(50))
    assert read_catalogue(path).tear == len(MAGIC)


def test_messages_outside_chunks_are_joined_into_runs(tmp_path, monkeypatch):
    messages = protobuf_messages(random_frames(1, 200))
    path = write_foreign(tmp_path / "f.mcap", messages, use_chunking=False)
    assert len(read_catalogue(path).regions) == 1
    monkeypatch.setattr(module, "RUN_BYTES", 5000)
    assert 5 < len(read_catalogue(path).regions) < 20


def written(chunk_bytes, cuts=(100,)):
    stream = io.BytesIO()
    writer = ContainerWriter(stream, "some profile", chunk_bytes)
    writer.attachment("a.txt", "text/plain", b"hello", 5)
    writer.metadata("facts", {"ä": "ö"})
    channel = writer.channel("/tf")
    records = [(channel, k, 1000 - k, k, bytes([k])) for k in range(100)]
    start = 0
    for stop in (*cuts, 100):
        writer.messages([record] for record in records[start:stop])
        start = stop
    writer.finish()
    return stream.getvalue()


@pytest.mark.parametrize("chunk_bytes", [1, 100, 1000, 1 << 20])
def test_the_mcap_library_reads_what_was_written_and_accepts_every_checksum(chunk_bytes):
    data = written(chunk_bytes)
    list(StreamReader(io.BytesIO(data), validate_crcs=True).records)
    reader = make_reader(io.BytesIO(data), validate_crcs=True)
    found = [(m.sequence, m.log_time, m.publish_time, m.data) for _, _, m in reader.iter_messages()]
    assert found == [(k, 1000 - k, k, bytes([k])) for k in reversed(range(100))]
    assert reader.get_header().profile == "some profile"
    assert [a.data for a in reader.iter_attachments()] == [b"hello"]
    assert [m.metadata for m in reader.iter_metadata()] == [{"ä": "ö"}]
    summary = reader.get_summary()
    assert (summary.statistics.message_start_time, summary.statistics.message_end_time) == (901, 1000)
    assert all(index.uncompressed_size < chunk_bytes + 32 for index in summary.chunk_indexes)


def test_chunks_end_where_the_size_says_and_not_where_blocks_do():
    assert written(1000, cuts=()) == written(1000, cuts=(1, 2, 50, 51)) == written(1000, cuts=(0, 100))


def test_a_file_without_messages_is_whole():
    stream = io.BytesIO()
    ContainerWriter(stream, "p").finish()
    assert make_reader(io.BytesIO(stream.getvalue()), validate_crcs=True).get_summary().statistics.message_count == 0


def test_every_checksum_notices_a_flipped_bit():
    data = written(1000)
    record = data.index(b"hello")
    for place in (record, len(data) // 3):
        broken = bytearray(data)
        broken[place] ^= 1
        with pytest.raises(Exception):  # noqa: B017 -- whichever checksum or decoder notices first
            list(StreamReader(io.BytesIO(bytes(broken)), validate_crcs=True).records)


@pytest.mark.parametrize("cuts", [(100,), (1, 2, 97), (50, 50)])
def test_chunks_end_by_time_too_wherever_blocks_end(cuts):
    """A message every 0.3 s and a chunk closed before the message that comes a second after its first."""
    stream = io.BytesIO()
    writer = ContainerWriter(stream, "p", 1 << 20, chunk_ns=1_000_000_000)
    channel, at = writer.channel("/tf"), 0
    for count in cuts:
        writer.messages([(channel, k, k * 300_000_000, k * 300_000_000, b"x")] for k in range(at, at + count))
        at += count
    writer.finish()
    summary = make_reader(io.BytesIO(stream.getvalue())).get_summary()
    spans = [(index.message_start_time, index.message_end_time) for index in summary.chunk_indexes]
    assert [start for start, _ in spans] == [k * 1_200_000_000 for k in range(25)]
    assert all(end - start == 900_000_000 for start, end in spans)
    assert summary.statistics.message_count == 100


def test_a_clock_that_jumps_back_closes_the_chunk():
    stream = io.BytesIO()
    writer = ContainerWriter(stream, "p", 1 << 20, chunk_ns=1_000_000_000)
    channel = writer.channel("/tf")
    writer.messages([(channel, k, t, t, b"x")] for k, t in enumerate([5 * 10**9, 10**9, 10**9 + 5]))
    writer.finish()
    assert len(make_reader(io.BytesIO(stream.getvalue())).get_summary().chunk_indexes) == 2
