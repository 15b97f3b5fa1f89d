"""The doctor's words on a damaged file and what is saved of it, side by side."""

import hashlib
import re
from dataclasses import replace

import numpy as np
import pytest
from mcap.opcode import Opcode
from support.mutants import chunks, flipped, records
from support.planted_faults import BODIES, FAULTS, clean_draft
from support.session_files import assert_same_frames, protobuf_messages, random_frames, write_foreign

from sessions import Event, read_session, write_session
from sessions.doctor.examine import examine
from sessions.errors import SessionFileError
from sessions.mcap import container
from sessions.mcap.metadata import bodies_record
from sessions.mcap.reader import McapFile
from sessions.mcap.salvage import RECOVERED, recover

BLOCK = 1 << 14
"""Bytes of a chunk: 50 frames."""
COUNT = 420
"""Frames of the whole file."""


@pytest.fixture(scope="module")
def whole_file(tmp_path_factory):
    """420 frames at 90 Hz of three bodies in chunks of some 50, a frozen pose, meshes, facts and an event."""
    draft = clean_draft()
    draft.arrays = {name: values[:COUNT] for name, values in draft.arrays.items()}
    FAULTS["frozen pose"](draft, body=0, frame=30)
    event = Event(int(draft.arrays["stamp_ns"][7]), "grasp", "takes a beaker", "flask")
    path = tmp_path_factory.mktemp("whole") / "s.mcap"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(container, "CHUNK_BYTES", BLOCK)
        write_session(replace(draft.session(), events=(event,), facts={"pseudonym": "S1"}), path)
    return path


@pytest.fixture(scope="module")
def whole_frames(whole_file):
    """The frames of the whole file."""
    return read_session(whole_file).frames


def listed(*names):
    """The list of bodies as a file has it."""
    return bodies_record(names)["names"].encode()


def record(opcode, change=lambda data, start, end: flipped(data, start, end, count=4, seed=1), skipped=9):
    """A change of the first record of a kind, behind its head or further."""

    def damage(data):
        start, end = next((start, end) for result, start, end in records(data) if result == opcode)
        return change(data, start + skipped, end)

    return damage


DAMAGE = {
    "none": lambda data: data,
    "a chunk": lambda data: flipped(data, chunks(data)[4][1] - 40, chunks(data)[4][1], count=5, seed=0),
    "a chunk that declares too much": record(
        Opcode.CHUNK, lambda data, start, end: data[: start + 22] + b"\1" + data[start + 23 :]
    ),
    "a mesh": record(Opcode.ATTACHMENT, skipped=80),
    "a header of noise": record(Opcode.HEADER, lambda data, a, b: data[:a] + b"\xff" * (b - a) + data[b:]),
    **{f"a {Opcode(kind).name.lower()}": record(kind) for kind in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.METADATA)},
    "a channel declared again with another name": record(
        Opcode.CHANNEL, lambda data, start, end: data[:end] + data[start - 9 : end].replace(b"/", b"_") + data[end:]
    ),
    "another body in the list": lambda data: data.replace(listed(*BODIES), listed(*BODIES[:2], "trap")),
    "an unknown version": lambda data: data.replace(b"vrlab/1", b"vrlab/9", 1),
    "cut in a chunk": lambda data: data[: chunks(data)[4][0] + 70],
    "cut before the index": lambda data: data[: chunks(data)[-1][1]],
    "cut before the first chunk": lambda data: data[: chunks(data)[0][0]],
    "cut in the footer": lambda data: data[:-1],
}


@pytest.mark.parametrize("name", DAMAGE)
def test_damaged_file_is_diagnosed_and_recovered_as_tabled(whole_file, whole_frames, tmp_path, name, snapshot):
    """A whole file of 420 frames gets a damage of DAMAGE; the doctor examines it, and its recovery writes a new file.

    Recovered frames are those of the whole file, unless the names of bodies are damaged; the new file has no such
    damage, and its facts say what was lost. All sentences of the doctor and of the recovery, or its refusal, equal the
    snapshot.
    """
    path, out = tmp_path / "damaged.mcap", tmp_path / "out.mcap"
    path.write_bytes(DAMAGE[name](whole_file.read_bytes()))
    reported = [f"{item.code} {item.body} {item.start}-{item.end} s: {item.message}" for item in examine(path)]
    try:
        result = recover(path, out)
    except SessionFileError as error:
        reported.append(str(error).replace(str(path), "FILE"))
    else:
        session = read_session(out)
        if session.names == whole_frames.names:
            is_recovered = np.isin(whole_frames.stamp_ns, session.frames.stamp_ns)
            assert_same_frames(session.frames, whole_frames.take(is_recovered))
        assert result.frames == len(session.frames) and result.whole == (not result.lost)
        assert session.facts[RECOVERED] == "; ".join(result.sentences()[: 1 + len(result.lost)])
        assert len(McapFile(out).catalogue.ids("/tf")) == 1
        assert not {item.code for item in examine(out)} & {"torn", "damaged-chunk", "unreadable"}
        reported += [
            *result.sentences(),
            f"of {', '.join(session.names)}: {', '.join(session.meshes)}; {session.events}",
        ]
    # How many bytes a chunk takes is a matter of the library that packs it.
    reported = [
        re.sub(r"byte \d+( of \d+)?|[\d,]+ bytes", "byte N", re.sub(r"damaged \(.*?\)", "damaged", item))
        for item in reported
    ]
    assert reported == snapshot


def damaged_file(tmp_path, data):
    """A file of these bytes."""
    path = tmp_path / "damaged.mcap"
    path.write_bytes(data)
    return path


def test_file_cut_anywhere_keeps_all_complete_chunks_unchanged(whole_file, whole_frames, tmp_path):
    """A file of 420 frames in chunks of some 50 is cut at three random bytes, and at the ends of two chunks.

    Recovered are the first frames, unchanged: at least 45 for each whole chunk but two, a lower bound. Only a file
    without a whole chunk is refused.
    """
    data, out = whole_file.read_bytes(), tmp_path / "out.mcap"
    spans = chunks(data)
    for offset in [*np.random.default_rng(2).integers(0, len(data), 3).tolist(), *(end for _, end in spans[2:4])]:
        complete = [end for _, end in spans if end <= offset]
        try:
            result = recover(damaged_file(tmp_path, data[:offset]), out, overwrite=True)
        except SessionFileError:
            assert not complete, offset
            continue
        assert result.frames >= min(COUNT, 45 * (len(complete) - 2)), offset
        kept = read_session(out).frames
        assert len(kept) == result.frames, offset
        if len(kept):
            assert_same_frames(kept, whole_frames.segment(0, len(kept)))


def test_foreign_file_is_recovered_with_its_channels(tmp_path):
    """Another program's file has 200 frames in chunks of 4 kB; the second half of its fourth chunk is damaged.

    More than 150 frames remain, not all, in a session file that says that it is foreign.
    """
    frames = random_frames(seed=3, count=200, bodies=2)
    path = write_foreign(tmp_path / "f.mcap", protobuf_messages(frames), chunk_size=4096)
    data = path.read_bytes()
    start, end = chunks(data)[3]
    result = recover(
        damaged_file(tmp_path, flipped(data, (start + end) // 2, end, count=5, seed=0)), tmp_path / "out.mcap"
    )
    assert 150 < result.frames < 200
    assert read_session(tmp_path / "out.mcap").facts["format"] == "foreign"


@pytest.mark.parametrize(
    "data, text", [(b"", "it is empty"), (b"hello", "not an MCAP"), (b"\x89MCAP0\r\n", "no chunk")]
)
def test_unrecoverable_file_is_explained_and_nothing_written(tmp_path, data, text):
    """A file has nothing in it, another text, or only the first eight bytes of a session file."""
    with pytest.raises(SessionFileError, match=text):
        recover(damaged_file(tmp_path, data), tmp_path / "out.mcap")
    assert not (tmp_path / "out.mcap").exists()


def test_recover_drops_an_undecodable_pose_message(tmp_path):
    """One of 200 messages starts with a byte that protobuf cannot decode, and no checksum betrays it."""
    messages = protobuf_messages(random_frames(seed=3, count=200, bodies=2))
    messages[7] = (*messages[7][:2], b"\xff" + messages[7][2][1:])
    path = write_foreign(tmp_path / "f.mcap", messages, enable_crcs=False)
    result = recover(path, tmp_path / "out.mcap")
    assert result.frames == 199
    assert not result.whole


def test_mesh_without_checksum_is_kept_if_its_hash_agrees(whole_file, tmp_path):
    """The checksum of a mesh is set to 0, which means none: its hash agrees, so that nothing is lost.

    Then its last byte is changed, or its hash is of another kind too: the mesh is lost.
    """
    data = bytearray(whole_file.read_bytes())
    end = next(end for opcode, _, end in records(data) if opcode == Opcode.ATTACHMENT)
    data[end - 4 : end] = bytes(4)
    assert recover(damaged_file(tmp_path, data), tmp_path / "out.mcap").whole
    data[end - 5] ^= 1
    for changed in (data, data.replace(b"sha256/", b"sha512/").replace(b"glTF", b"none", 1)):
        assert len(recover(damaged_file(tmp_path, changed), tmp_path / "out.mcap", overwrite=True).lost) == 1


def test_the_damaged_file_is_not_overwritten(whole_file, tmp_path):
    """A file is recovered to itself, which is refused and leaves it bit for bit; so is a file that is not there."""
    digest = hashlib.sha256(whole_file.read_bytes()).hexdigest()
    with pytest.raises(SessionFileError, match="the damaged file itself"):
        recover(whole_file, whole_file, overwrite=True)
    assert hashlib.sha256(whole_file.read_bytes()).hexdigest() == digest
    with pytest.raises(SessionFileError, match="does not exist"):
        recover(tmp_path / "none.mcap", tmp_path / "new.mcap")
