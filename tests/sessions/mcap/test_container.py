import pytest
from support.session_files import protobuf_messages, random_frames, session_of, tetrahedron, write_foreign

from sessions.errors import SessionFileError
from sessions.mcap import container as module
from sessions.mcap.writer import write_session


def read_catalogue(path):
    with path.open("rb") as stream:
        return module.read_catalogue(path, stream)


@pytest.fixture
def path(tmp_path):
    write_session(session_of(random_frames(1, 3000, 6), meshes={"a": tetrahedron()}), tmp_path / "s.mcap")
    return tmp_path / "s.mcap"


def test_a_chunk_without_a_message_index_may_hold_anything(tmp_path):
    from mcap.writer import IndexType

    path = write_foreign(tmp_path / "f.mcap", protobuf_messages(random_frames(1)), index_types=IndexType.NONE)
    assert [region.channels for region in read_catalogue(path).regions] == [None]


def test_tear_is_at_first_incomplete_record(path):
    data = path.read_bytes()
    chunk = read_catalogue(path).regions[1]
    path.write_bytes(data[: chunk.span.start + 70])
    torn = read_catalogue(path)
    assert len(torn.regions) == 1 and torn.tear == chunk.span.start
    path.write_bytes(data[:-1])
    assert read_catalogue(path).tear is not None


@pytest.mark.parametrize(
    ("kind", "limit"),
    [("chunk", "CHUNK_LIMIT_BYTES"), ("attachment", "RECORD_LIMIT_BYTES"), ("message", "CHUNK_LIMIT_BYTES")],
)
def test_oversized_declarations_are_refused_before_reading(path, tmp_path, monkeypatch, kind, limit):
    if kind == "message":
        path = write_foreign(tmp_path / "f.mcap", protobuf_messages(random_frames(1)), use_chunking=False)
    monkeypatch.setattr(module, limit, 500 if kind == "attachment" else 5)
    with pytest.raises(SessionFileError, match=rf"a {kind} record declares \d+ bytes, more than the 5(00)?"):
        read_catalogue(path)


def test_attachment_name_is_reported_only_if_complete():
    record = bytes(25) + (8).to_bytes(4, "little") + b"stem.glb" + bytes(30)
    names = [module.attachment_name(record[:size]) for size in range(25, len(record))]
    assert names == [""] * 12 + ["stem.glb"] * 30
