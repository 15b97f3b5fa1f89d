"""Session files that are wrong on purpose: rows of a table, draws of hypothesis over records, and small bombs."""

import json
import struct
import warnings
from dataclasses import replace

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from google.protobuf.message import DecodeError
from hypothesis import strategies as st
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Metadata
from mcap.writer import CompressionType
from support.mutants import (
    MESSAGE,
    body_and_index,
    closed,
    damaged_below_checksums,
    joined,
    opened,
    split,
    with_messages,
    with_records,
    without_index,
)
from support.planted_faults import BODIES, POSE_CHANNEL, START_NS, STEP_NS, clean_draft
from support.session_files import protobuf_messages, write_foreign

from cdcore.errors import CollisionCoreError
from replay.engine import compute
from replay.errors import ReplayError
from replay.prepare.session_info import session_info
from sessions import Event, HandTrack, Interval, Recorder, Severity, examine, parse_scene, read_session, recover
from sessions.errors import SessionError
from sessions.mcap.writer import write_session

NUMBERS = [0, 1, 7, 255, 2**16 - 1, 2**31, 2**32 - 1, 2**62, 2**63 - 1, 2**63, 2**64 - 1]
TEXTS = ["", "../../x", "a\nb", "\x1b[31mred", "\u202eevil", "x" * 5000, "<script>", "\0", "/tf", "world", BODIES[0]]
FLOATS = [np.nan, np.inf, 1e308, -1e20, 0.0]
FIELDS = {
    "parent_frame_id": TEXTS,
    "child_frame_id": TEXTS,
    "translation.x": FLOATS,
    "rotation.x": FLOATS,
    "timestamp.seconds": [2**62, -(2**62), 9223372037, -1],
}
"""Field of a transform -> values that it had better not have."""


def good_files(folder):
    """The files that wrong ones are made of; the doctor finds no error in those of our own profile."""
    draft = clean_draft()
    session = draft.session().between(START_NS, START_NS + 199 * STEP_NS)
    stamps = session.frames.stamp_ns
    first = int(stamps[0])
    whole = replace(
        session,
        events=(Event(first + 9, "grasp", "takes", "flask"),),
        intervals=(Interval(first, first + 99, "task", "stir"),),
        hands={"student/right": HandTrack(stamps[:60], np.zeros(60), np.zeros(60), ("menu",), np.zeros((60, 1)))},
        scene=parse_scene("".join(f'[[body]]\nid = "{name}"\n' for name in BODIES)),
    )
    write_session(whole, folder / "own.mcap")
    with Recorder(folder / "live.mcap", meshes=draft.meshes) as recorder:
        for k, stamp in enumerate(stamps[:40].tolist()):
            poses = (session.frames.position[k], session.frames.quaternion_xyzw[k])
            recorder.poses(stamp, {name: (poses[0][c], poses[1][c]) for c, name in enumerate(BODIES)}, log_ns=stamp)
    messages = protobuf_messages(session.frames)[:60]
    write_foreign(folder / "lz4.mcap", messages, chunk_size=4000, compression=CompressionType.LZ4)
    write_foreign(folder / "loose.mcap", messages, use_chunking=False)
    return {path.stem: path.read_bytes() for path in sorted(folder.glob("*.mcap"))}


# --- Records that a hostile writer adds and changes ---


def chunk(entries):
    """A chunk with these records."""
    return Opcode.CHUNK, closed(joined(entries))


def record(entry):
    """The record of an entry of MCAP."""
    builder = RecordBuilder()
    entry.write(builder)
    return split(builder.end())[0]


def attachment(name, data):
    """The record of an attachment."""
    return record(Attachment(0, 0, name, "x", data))


def facts(**words):
    """The record of a session's facts."""
    return record(Metadata("vrlab.session", words))


def message(number, payload=b"", which=1):
    """A message of a channel, at the nanosecond of its number."""
    return Opcode.MESSAGE, MESSAGE.pack(which, 0, number, number) + payload


def named(count, first=0):
    """Poses of bodies called n0, n1, ..."""
    poses = FrameTransforms()
    for k in range(first, first + count):
        pose = poses.transforms.add(parent_frame_id="world", child_frame_id=f"n{k}")
        pose.rotation.w = 1.0
    return poses.SerializeToString()


def plus(*added):
    """A change that adds records before the last one."""
    return lambda data: with_records(data, lambda entries: [*entries[:-1], *added, entries[-1]])


def of_chunk(change):
    """Change the content of the last chunk."""

    def changed(entries):
        last = max(k for k, (kind, _) in enumerate(entries) if kind == Opcode.CHUNK)
        return [*entries[:last], (Opcode.CHUNK, change(entries[last][1])), *entries[last + 1 :]]

    return lambda data: with_records(data, changed)


def of_messages(change, channel=None):
    """A change of the file that changes its messages, those of one channel if given."""
    return lambda data: with_messages(data, change, channel)


def of_heads(field, value):
    """Change a number of the head of every message by the frame: channel, sequence, log time or publish time."""

    def change(content):
        head = list(MESSAGE.unpack_from(content))
        head[field] = value((head[3] - START_NS) // STEP_NS)
        return MESSAGE.pack(*head) + content[MESSAGE.size :]

    return of_messages(change)


def with_poses(content, path, *values):
    """A message with a field of its transforms set to the values in turn."""
    poses = FrameTransforms.FromString(content[MESSAGE.size :])
    *pieces, name = path.split(".")
    for k, pose in enumerate(poses.transforms):
        setattr(getattr(pose, pieces[0]) if pieces else pose, name, values[k % len(values)])
    return content[: MESSAGE.size] + poses.SerializeToString()


def of_poses(path, *values):
    """A change of a field of every pose."""
    return of_messages(lambda content: with_poses(content, path, *values), POSE_CHANNEL)


def glb(words, length=None):
    """A GLB of this JSON that claims a length."""
    body = json.dumps(words).encode()
    body += b" " * (-len(body) % 4)
    size = 20 + len(body) if length is None else length
    return b"glTF" + struct.pack("<II", 2, size) + struct.pack("<I4s", len(body), b"JSON") + body


def listed(names):
    """The record that lists bodies."""
    return record(Metadata("vrlab.bodies", {"names": json.dumps(names)}))


def scene(words):
    """The record of a scene."""
    return attachment("scene.toml", words)


ENDLESS = {
    "accessors": [{"count": 2**40, "type": "VEC3", "componentType": 5126}],
    "scenes": [{"nodes": [0]}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
    "nodes": [{"mesh": 0}],
}
LOOP = {"nodes": [{"children": [0]}], "scenes": [{"nodes": [0]}], "asset": {"version": "2.0"}}
INSERTED = [
    listed([f"n{k}" for k in range(4097)]),
    listed(["flask", "flask"]),
    listed(["flask"]),
    listed([1, 2]),
    listed(["", *BODIES]),
    record(Metadata("vrlab.bodies", {"names": "[" * 100_000})),
    facts(format="vrlab/1", pseudonym="S01"),
    facts(**{"\x1b[2J": "\x1b]0;own\x07", "a\nb": "\u202e"}),
    facts(format="vrlab/1", consent="x" * 10**6),
    attachment("meshes/../../evil.glb", b"x"),
    *(attachment("meshes/flask.glb", data) for data in (glb(ENDLESS), glb(LOOP), glb({}, 2**32 - 1))),
    scene(b"\xff\xfe\x00"),
    scene(b'[[body]]\nid="flask"\nparent="tray"\n[[body]]\nid="tray"\nparent="flask"\n'),
    scene(b'[[body]]\nid="flask"\nmesh="/etc/passwd"\n'),
    scene(b'[scene]\nspace_radius=nan\n[[body]]\nid="flask"\n'),
    record(Channel(1, "/events", "protobuf", {}, 1)),
    record(Channel(1, "/tf", "protobuf", {}, 999)),
    record(Channel(900, "/hands//", "protobuf", {}, 1)),
    record(Channel(901, "/hands/\x1b[2J\u202e/l", "protobuf", {}, 1)),
    message(10**18, named(2)),
    chunk([message(1, named(300))]),
    (200, b"x"),
    (Opcode.CHUNK, b""),
    (Opcode.MESSAGE, b"\x01"),
]
"""Records that a file had better not hold."""

WRONG = {
    "nothing": lambda data: b"",
    "a damaged mark": lambda data: b"\x88" + data[1:],
    "zeros after the mark": lambda data: data[:8] + bytes(100_000),
    "two sessions in a row": lambda data: data * 2,
    "the second half": lambda data: data[len(data) // 2 :],
    "no footer": lambda data: data[:-37],
    "records in the wrong order": lambda data: with_records(data, lambda entries: [entries[0], *entries[:0:-1]]),
    "an index at byte 2^63": lambda data: data[:-28] + struct.pack("<Q", 2**63) + data[-20:],
    "poses in JSON": of_chunk(lambda c: closed(opened(c).replace(b"protobuf", b"protobad"))),
    "an unknown version": lambda data: data.replace(b"vrlab/1", b"vrlab/9"),
    "a chunk that unpacks to 2^63": of_chunk(lambda c: c[:16] + struct.pack("<Q", 2**63) + c[24:]),
    "a chunk with another checksum": of_chunk(lambda c: c[:24] + bytes(4) + b"1" + c[29:]),
    "a chunk packed by nobody knows what": of_chunk(lambda c: c.replace(b"zstd", b"tsdz", 1)),
    "a chunk in a chunk": of_chunk(lambda c: closed(joined([(Opcode.CHUNK, c)]))),
    "a body twice in a message": of_messages(lambda content: content + content[MESSAGE.size :]),
    "messages that are none": of_messages(lambda content: content[: MESSAGE.size] + b"\xff"),
    "messages of every channel": of_heads(0, lambda k: k % 12),
    "log times of 2^63": of_heads(2, lambda k: 2**63),
    "frames all at one time": of_heads(2, lambda k: 10**18),
    "frames backwards": of_heads(3, lambda k: 2 * 10**18 - k),
    "frames from 0 to 2^63 - 1": of_heads(3, lambda k: (0, 2**63 - 1)[k % 2]),
    "every place not a number": of_poses("translation.x", np.nan),
    "places of 1e308": of_poses("translation.z", 1e308, -1e308),
    "rotations of zero": of_poses("rotation.w", 0.0),
    "a body that is the world": of_poses("child_frame_id", "world"),
    "names of control characters": of_poses("child_frame_id", "\x1b[2J", "\u202e\n", "\0"),
    **{f"inserted record {k}": plus(record) for k, record in enumerate(INSERTED)},
}
"""What is wrong -> what it makes of a good file."""


# --- Draws over records ---


def redrawn(draw, opcode, content):
    """A record with one thing in it drawn anew: a message of a chunk, a field of the poses, a number or a byte."""
    if opcode == Opcode.CHUNK and draw(st.booleans()) and (pieces := split(opened(content))):
        return chunk(edited(draw, pieces))
    if opcode == Opcode.MESSAGE and draw(st.booleans()):
        path = draw(st.sampled_from(sorted(FIELDS)))
        try:
            return opcode, with_poses(content, path, draw(st.sampled_from(FIELDS[path])))
        except DecodeError:
            return opcode, content
    kind = draw(st.sampled_from(["<B", "<H", "<I", "<Q"]))
    size = struct.calcsize(kind)
    if len(content) < size:
        return opcode, content
    offset = draw(st.integers(0, min(len(content) - size, 200)))
    value = draw(st.sampled_from(NUMBERS)) & ((1 << 8 * size) - 1)
    return opcode, content[:offset] + struct.pack(kind, value) + content[offset + size :]


def edited(draw, entries):
    """One record changed, or put elsewhere: left out, doubled, in place of another, or a record of `INSERTED` there."""
    k, to = (draw(st.integers(0, len(entries) - 1)) for _ in range(2))
    changed = list(entries)
    what = draw(st.sampled_from(["change", "change", "change", "drop", "double", "swap", "insert"]))
    if what == "change":
        changed[k] = redrawn(draw, *entries[k])
    elif what == "drop":
        del changed[k]
    elif what == "swap":
        changed[k], changed[to] = entries[to], entries[k]
    else:
        changed.insert(to, entries[k] if what == "double" else draw(st.sampled_from(INSERTED)))
    return changed


@st.composite
def wrong_bytes(draw, files):
    """A good file with records changed, with or without its index, or with its bytes damaged."""
    data = files[draw(st.sampled_from(sorted(files)))]
    if draw(st.booleans()):
        return draw(damaged_below_checksums(data))
    pieces, index = body_and_index(data)
    for _ in range(draw(st.integers(1, 3))):
        pieces = edited(draw, pieces)
    if draw(st.booleans()):  # the index as it was: its offsets are wrong now
        return data[:8] + joined(pieces) + index
    return without_index(pieces, data[:8], draw(st.sampled_from(NUMBERS)))


# --- Small files that ask for much ---


def many_names(count, each=5000):
    """Chunks that name very many bodies, 5000 a message."""
    rows = [message(k, named(each, k * each)) for k in range(count // each)]
    return [chunk(rows[k : k + 50]) for k in range(0, len(rows), 50)]


TAGGED = b"".join(b'[[body]]\nid="b%d"\ntags=["x"]\n' % k for k in range(5000))
BOMBS = {
    "a million names": lambda: many_names(1_000_000),
    "two million empty messages": lambda: [chunk([message(5)] * 2_000_000)],
    "a scene of dots": lambda: [scene(b"a" + b".a" * 200_000 + b"=1\n")],
    "tags times tags": lambda: [scene(TAGGED + b'[[pair]]\nbetween=["tag:x", "tag:x"]\n' * 100)],
    "a million tiny records": lambda: [(0x90, b"")] * 1_000_000,
}
"""Name -> records that a good file holds more."""


# --- What the verbs say ---

KNOWN = (SessionError, ReplayError, CollisionCoreError)
STRUCTURE = {"torn", "unreadable", "damaged-chunk", "bad-message"}


def answer(work):
    """Whether it is accepted, and what is said: one sentence of a known error."""
    try:
        return True, str(work() or "")
    except KNOWN as error:
        assert str(error).strip() and str(error).isprintable(), repr(str(error))
        return False, str(error)


def verbs(path, out):
    """Whether each verb accepts a file, and what it says; ``doctor`` accepts where it finds no error."""
    findings = [finding for finding in examine(path) if finding.severity == Severity.ERROR]
    answers = {"doctor": (not findings, "; ".join(f"{finding.code}: {finding.message}" for finding in findings))}
    answers["info"] = answer(lambda: session_info(read_session(path)) and "")
    answers["run"] = answer(lambda: compute(read_session(path), detectors=()) and "")
    out.unlink(missing_ok=True)
    kept = []
    answers["recover"] = answer(lambda: kept.append(recover(path, out)) or "")
    if kept:
        answers["recover"] = (True, "; ".join(kept[0].sentences()))
        answers["whole"] = (kept[0].whole, "")
        answers["again"] = answer(lambda: session_info(read_session(out)) and "")
        left = [finding.code for finding in examine(out) if finding.code in STRUCTURE]
        answers["healed"] = (not left, "; ".join(left))
    else:
        assert not out.exists()
    return answers


def contradictions(data, folder):
    """Answers of two verbs on one file that cannot both be true, and files that they leave elsewhere."""
    path, out = folder / "wrong.mcap", folder / "out.mcap"
    path.write_bytes(data)
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        answers = verbs(path, out)
    yes = {verb: accepted for verb, (accepted, _) in answers.items()}
    labels = {verb: sentence for verb, (_, sentence) in answers.items()}
    wrong = {
        "the doctor passes what info refuses": yes["doctor"] and not yes["info"],
        "the doctor passes what run refuses": yes["doctor"] and not yes["run"],
        "run accepts what info refuses": yes["run"] and not yes["info"],
        "info refuses what recover wrote": not yes.get("again", True),
        "the doctor sends what recover wrote to recover": not yes.get("healed", True),
        "nothing was lost or mended of a file that info refuses": (
            yes.get("whole", False) and not yes["info"] and "mended" not in labels["recover"]
        ),
        "recover saves nothing of a file that info reads": yes["info"] and not yes["recover"],
        "the doctor sees no MCAP, recover saves some": "not-mcap" in labels["doctor"] and yes["recover"],
    }
    elsewhere = [f"left {file.name}" for file in folder.iterdir() if file not in (path, out)]
    return [f"{sentence}: {answers}" for sentence, holds in wrong.items() if holds] + elsewhere
