import io

import pytest
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader

from sessions.mcap_format.container import ContainerWriter
from sessions.mcap_format.record_block import RecordBlock


def written(chunk_bytes, cuts=(100,)):
    stream = io.BytesIO()
    writer = ContainerWriter(stream, "some profile", chunk_bytes)
    writer.attachment("a.txt", "text/plain", b"hello", 5)
    writer.metadata("facts", {"ä": "ö"})
    channel = writer.channel("/tf")
    records = [(channel, k, 1000 - k, k, bytes([k])) for k in range(100)]
    start = 0
    for stop in (*cuts, 100):
        writer.messages(RecordBlock.of(records[start:stop]))
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
        writer.messages(
            RecordBlock.of((channel, k, k * 300_000_000, k * 300_000_000, b"x") for k in range(at, at + count))
        )
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
    writer.messages(RecordBlock.of((channel, k, t, t, b"x") for k, t in enumerate([5 * 10**9, 10**9, 10**9 + 5])))
    writer.finish()
    assert len(make_reader(io.BytesIO(stream.getvalue())).get_summary().chunk_indexes) == 2
