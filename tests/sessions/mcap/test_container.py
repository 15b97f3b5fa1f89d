import pytest
from mcap.records import Chunk
from mcap.stream_reader import StreamReader
from support.session_files import protobuf_messages, random_frames, session_of, tetrahedron, write_foreign

from sessions.errors import SessionFileError
from sessions.mcap import container as module
from sessions.mcap.writer import write_session


def read_catalogue(path):
    """The catalogue of a file: its chunks ("regions"), each with the channels that it holds."""
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
    """Another program wrote a file without such indices: nobody knows the channels of its only chunk (None)."""
    from mcap.writer import IndexType

    path = write_foreign(tmp_path / "f.mcap", protobuf_messages(random_frames(seed=1)), index_types=IndexType.NONE)
    assert [region.channels for region in read_catalogue(path).regions] == [None]


def test_tear_is_at_first_incomplete_record(session_file):
    """The file is cut 70 bytes into its second chunk: its first is read, and the tear is where the second begins."""
    data = session_file.read_bytes()
    _first_chunk, second_chunk, *_others = read_catalogue(session_file).regions
    session_file.write_bytes(data[: second_chunk.span.start + 70])
    catalogue = read_catalogue(session_file)
    assert len(catalogue.regions) == 1
    assert catalogue.tear == second_chunk.span.start


def test_file_that_lacks_its_last_byte_is_torn(session_file):
    """The last byte is of the mark at the end of every file: without it the file has a ``tear``, as if cut short."""
    session_file.write_bytes(session_file.read_bytes()[:-1])
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
    """The record of an attachment has the length of its name, 8, in bytes 25 to 28, and the name in bytes 29 to 36.

    Cut to 25 up to 36 bytes, 12 sizes, it lacks a letter or more; with 37 and more the name is whole.
    """
    record = bytes(25) + (8).to_bytes(4, "little") + b"stem.glb" + bytes(30)
    names = [module.attachment_name(record[:size]) for size in range(25, len(record))]
    assert names == [""] * 12 + ["stem.glb"] * 30


def test_chunk_that_claims_its_neighbour_hides_no_messages(session_file, tmp_path):
    """The first of several chunks states a length that ends with the second; the catalogue has both all the same."""
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
