import pytest
from mcap.opcode import Opcode
from support.damage import records
from support.planted_faults import BODIES, FAULTS, clean, unknown_frame

from sessions.doctor.examine import examine
from sessions.mcap_format import container
from sessions.mcap_format.mcap_file import McapFile
from sessions.mcap_format.metadata import bodies_record


@pytest.fixture
def path(tmp_path, monkeypatch):
    """A clean session in many small chunks."""
    monkeypatch.setattr(container, "CHUNK_BYTES", 1 << 15)
    draft = clean()
    FAULTS["frozen pose"](draft, 0, 200)
    return draft.write(tmp_path / "s.mcap")


def chunks_of(path):
    return [region for region in McapFile(path).catalogue.regions if region.is_chunk]


@pytest.mark.parametrize("share", [0.3, 0.7, 0.999])
def test_a_file_cut_short_is_torn_and_the_rest_is_still_examined(path, share):
    data = path.read_bytes()
    path.write_bytes(data[: int(share * len(data))])
    found = examine(path)
    assert found[0].code in ("torn", "no-poses")
    torn = next(one for one in found if one.code == "torn")
    assert f"of {int(share * len(data))}" in torn.message


def test_a_flipped_byte_in_a_chunk_is_found_with_the_time_it_costs(path):
    place = chunks_of(path)[4]
    data = bytearray(path.read_bytes())
    data[place.place.start + 160] ^= 0x10
    path.write_bytes(data)
    found = {one.code: one for one in examine(path)}
    assert (found["damaged-chunk"].start_ns, found["damaged-chunk"].end_ns) == (place.first_ns, place.last_ns)
    assert "gap" in found


def test_an_attachment_that_changed_is_found(path):
    data = bytearray(path.read_bytes())
    data[data.find(b"glTF") + 40] ^= 1
    path.write_bytes(data)
    found = {one.code for one in examine(path)}
    assert "damaged-attachment" in found


def test_an_unknown_version_is_named_and_the_poses_are_examined_all_the_same(path):
    data = path.read_bytes().replace(b"vrlab/1", b"vrlab/9", 1)
    path.write_bytes(data)
    found = {one.code: one for one in examine(path)}
    assert "newer" in found["unknown-version"].fix and "vrlab/9" in found["unknown-version"].message
    assert "frozen" in found


def test_bodies_of_other_frames_and_bodies_that_are_not_listed_are_noted_and_examined(tmp_path):
    draft = clean()
    unknown_frame(draft, 1, 300)
    path = draft.write(tmp_path / "a.mcap")
    names = bodies_record(BODIES)["names"].encode()
    listed = bodies_record(("flask", *(f"{name[:-1]}_" for name in BODIES[1:])))["names"].encode()
    path.write_bytes(path.read_bytes().replace(names, listed))
    found = [one for one in examine(path) if one.code == "unknown-frame"]
    assert {(one.body, one.count): one.message for one in found} == {
        ("hand-left", 50): "50 samples are given in frame 'attic', the others in 'world'",
        ("hand-left", 850): "850 samples of a body that the file does not list",
        ("tray", 900): "900 samples of a body that the file does not list",
    }


def test_a_damaged_record_does_not_end_the_examination(path):
    data = path.read_bytes()
    start, end = next((a, b) for opcode, a, b in records(data) if opcode == Opcode.HEADER)
    path.write_bytes(data[: start + 9] + b"\xff" * (end - start - 9) + data[end:])
    found = {one.code for one in examine(path)}
    assert {"unreadable", "frozen"} <= found
