import pytest
from mcap.records import Chunk
from mcap.stream_reader import StreamReader
from support.session_files import protobuf_messages, random_frames, session_of, tetrahedron, write_foreign

from sessions.errors import SessionFileError
from sessions.mcap import container as module
from sessions.mcap.writer import write_session


def read_catalogue(path):
    """The catalogue of a file."""
    with path.open("rb") as stream:
        return module.read_catalogue(path, stream)


@pytest.fixture
def session_file(tmp_path):
    """A session of 3,000 frames and six bodies."""
    write_session(
        session_of(random_frames(seed=1, count=3000, bodies=6), meshes={"a": tetrahedron()}), tmp_path / "s.mcap"
    )
    return tmp_path / "s.mcap"


def test_a_chunk_without_a_message_index_may_hold_anything(tmp_path):
    """``channels`` of a region are those of its index; None: any."""
    from mcap.writer import IndexType

    path = write_foreign(tmp_path / "f.mcap", protobuf_messages(random_frames(seed=1)), index_types=IndexType.NONE)
    assert [region.channels for region in read_catalogue(path).regions] == [None]


def test_tear_is_at_first_incomplete_record(session_file):
    """The file is cut 70 bytes into its second chunk, and then before its last byte."""
    data = session_file.read_bytes()
    chunk = read_catalogue(session_file).regions[1]
    session_file.write_bytes(data[: chunk.span.start + 70])
    torn = read_catalogue(session_file)
    assert len(torn.regions) == 1 and torn.tear == chunk.span.start
    session_file.write_bytes(data[:-1])
    assert read_catalogue(session_file).tear is not None


@pytest.mark.parametrize(
    ("kind", "limit"),
    [("chunk", "CHUNK_LIMIT_BYTES"), ("attachment", "RECORD_LIMIT_BYTES"), ("message", "CHUNK_LIMIT_BYTES")],
)
def test_oversized_declarations_are_refused_before_reading(session_file, tmp_path, monkeypatch, kind, limit):
    """The limit of a kind of record is lowered to 5 bytes (500 of an attachment); every such record declares more."""
    if kind == "message":
        session_file = write_foreign(tmp_path / "f.mcap", protobuf_messages(random_frames(seed=1)), use_chunking=False)
    monkeypatch.setattr(module, limit, 500 if kind == "attachment" else 5)
    with pytest.raises(SessionFileError, match=rf"a {kind} record declares \d+ bytes, more than the 5(00)?"):
        read_catalogue(session_file)


def test_attachment_name_is_reported_only_if_complete():
    """The length of the name stands at byte 25, its eight letters end at byte 37: 12 sizes are too short."""
    record = bytes(25) + (8).to_bytes(4, "little") + b"stem.glb" + bytes(30)
    names = [module.attachment_name(record[:size]) for size in range(25, len(record))]
    assert names == [""] * 12 + ["stem.glb"] * 30


def test_chunk_that_claims_its_neighbour_hides_no_messages(session_file, tmp_path):
    """The stated length of the first chunk is written so that it ends with the second."""
    regions = read_catalogue(session_file).regions
    first, second = regions[0].span, regions[1].span
    content = bytearray(session_file.read_bytes())
    length_at = first.start + module.HEAD.size + 28  # behind two log times, the unpacked size and its checksum
    length_at += 4 + int.from_bytes(content[length_at : length_at + 4], "little")
    claimed = int.from_bytes(content[length_at : length_at + 8], "little") + second.end - first.end
    content[length_at : length_at + 8] = claimed.to_bytes(8, "little")
    changed = tmp_path / "claims.mcap"
    changed.write_bytes(content)
    assert len(read_catalogue(changed).regions) == len(regions)
    # The reason why the library's reader does not list files here: it passes over the second chunk.
    with changed.open("rb") as stream:
        records = [*StreamReader(stream, emit_chunks=True).records]
    assert sum(isinstance(record, Chunk) for record in records) == len(regions) - 1
