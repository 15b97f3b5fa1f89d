import numpy as np
from support.mcap_samples import assert_same_frames
from support.planted_faults import clean, unknown_frame

from sessions import Frames, read_session
from sessions.doctor.tolerant_frames import TolerantFrames
from sessions.mcap_format.mcap_file import McapFile


def test_a_sound_file_is_read_as_the_strict_reader_reads_it(tmp_path):
    path = clean().write(tmp_path / "a.mcap")
    session = read_session(path)
    tolerant = TolerantFrames(McapFile(path), session.names)
    assert_same_frames(Frames.join([*tolerant.blocks()]), session.frames)
    assert tolerant.noted.unpacked == tolerant.noted.unread == [] and not tolerant.noted.doubled
    assert {key: seen.count for key, seen in tolerant.noted.frames.items()} == {
        ("world", name): 900 for name in session.names
    }


def test_bodies_of_other_frames_and_bodies_that_are_not_listed_are_read_and_noted(tmp_path):
    draft = clean()
    unknown_frame(draft, 1, 300)
    path = draft.write(tmp_path / "a.mcap")
    tolerant = TolerantFrames(McapFile(path), ("flask",))
    frames = Frames.join([*tolerant.blocks()])
    assert tolerant.names == ("flask", "hand-left", "tray")
    assert np.array_equal(frames.position, draft.arrays["position"])
    seen = tolerant.noted.frames["attic", "hand-left"]
    stamps = draft.arrays["stamp_ns"]
    assert (seen.first_ns, seen.last_ns, seen.count) == (stamps[300], stamps[349], 50)


def test_a_damaged_chunk_is_noted_and_the_others_are_read(tmp_path):
    path = clean().write(tmp_path / "a.mcap")
    file = McapFile(path)
    region = file.catalogue.regions[-1]
    data = bytearray(path.read_bytes())
    data[region.offset + region.length // 2] ^= 0xFF
    path.write_bytes(data)
    tolerant = TolerantFrames(McapFile(path), ("flask", "hand-left", "tray"))
    assert sum(map(len, tolerant.blocks())) < 900
    ((damaged, why),) = tolerant.noted.unpacked
    assert damaged.offset == region.offset and "damaged" in why
