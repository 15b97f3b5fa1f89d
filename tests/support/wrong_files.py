"""Session files that are wrong on purpose: rows of a table, draws of hypothesis over records, and small bombs."""

import json
import struct
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from google.protobuf.message import DecodeError
from hypothesis import strategies as st
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, McapRecord, Metadata
from mcap.writer import CompressionType
from support.damage import HEAD, closed, damaged_below_checksums, opened
from support.mcap_samples import protobuf_messages, session_of, tetrahedron, write_foreign

from cdcore.errors import CollisionCoreError
from replay.errors import ReplayError
from replay.pipeline.engine import compute
from replay.session_info import session_info
from sessions import Event, Frames, HandTrack, Interval, Recorder, Severity, examine, parse_scene, read_session, recover
from sessions.errors import SessionError
from sessions.mcap_format.writer import write_session

MESSAGE = struct.Struct("<HIQQ")
TF_CHANNEL = 1
"""The first channel that a session file declares."""
NUMBERS = [0, 1, 7, 255, 2**16 - 1, 2**31, 2**32 - 1, 2**62, 2**63 - 1, 2**63, 2**64 - 1]
TEXTS = ["", "../../x", "a\nb", "\x1b[31mred", "\u202eevil", "x" * 5000, "<script>", "\0", "/tf", "world", "body 0"]
PARTS = list[tuple[int, bytes]]


def good_files(folder: Path) -> dict[str, bytes]:
    """The files that wrong ones are made of; the doctor finds no error in those of our own profile."""
    rng, count = np.random.default_rng(4), 200
    stamp = 1_700_000_000_000_000_000 + np.arange(count) * 11_111_111
    position = 0.2 * np.sin(np.linspace(0, 9, count))[:, None, None] + rng.normal(0, 1e-4, (count, 2, 3))
    position[:, 1, 0] += 1.0
    quaternion = np.array([0, 0, 0, 1]) + rng.normal(0, 1e-4, (count, 2, 4))
    quaternion /= np.linalg.norm(quaternion, axis=-1, keepdims=True)
    sample, status = np.repeat(stamp[:, None], 2, axis=1), np.ones((count, 2), dtype=np.uint8)
    frames = Frames(("body 0", "body 1"), stamp, stamp + 700, sample, position, quaternion, status)
    parts = {
        "meshes": {"body 0": tetrahedron(0.2), "body 1": tetrahedron(0.3)},
        "events": [Event(int(stamp[3]), "grasp", "takes", "body 1")],
        "intervals": [Interval(int(stamp[0]), int(stamp[9]), "task", "stir")],
        "hands": {"student/right": HandTrack(stamp[:60], np.zeros(60), np.zeros(60), ("menu",), np.zeros((60, 1)))},
        "scene": parse_scene('[[body]]\nid = "body 1"\n[[body]]\nid = "body 0"\n'),
    }
    write_session(session_of(frames, **parts), folder / "own.mcap")
    with Recorder(folder / "live.mcap", meshes=parts["meshes"], overwrite=True) as recorder:
        for k in range(40):
            pose = {name: (position[k, c], quaternion[k, c]) for c, name in enumerate(frames.names)}
            recorder.poses(int(stamp[k]), pose, log_ns=int(stamp[k]))
    messages = protobuf_messages(frames)[:60]
    write_foreign(folder / "lz4.mcap", messages, chunk_size=4000, compression=CompressionType.LZ4)
    write_foreign(folder / "loose.mcap", messages, use_chunking=False)
    return {path.stem: path.read_bytes() for path in sorted(folder.glob("*.mcap"))}


# --- Files as lists of records: what a hostile writer has in hand ---


def split(data: bytes) -> PARTS:
    """(opcode, content) of the records in a row."""
    records, start = [], 0
    while start + HEAD.size <= len(data):
        opcode, length = HEAD.unpack_from(data, start)
        records.append((opcode, data[start + HEAD.size : start + HEAD.size + length]))
        start += HEAD.size + length
    return records


def joined(parts: PARTS) -> bytes:
    return b"".join(HEAD.pack(opcode, len(content)) + content for opcode, content in parts)


def inside(chunk: bytes) -> PARTS:
    """The records of a chunk packed by zstd, or none."""
    return split(opened(chunk))


def chunk(parts: PARTS) -> tuple[int, bytes]:
    return Opcode.CHUNK, closed(joined(parts))


def record(entry: McapRecord) -> tuple[int, bytes]:
    builder = RecordBuilder()
    entry.write(builder)
    return split(builder.end())[0]


def attachment(name: str, data: bytes) -> tuple[int, bytes]:
    return record(Attachment(0, 0, name, "x", data))


def message(number: int, payload: bytes = b"", which: int = 1) -> tuple[int, bytes]:
    return Opcode.MESSAGE, MESSAGE.pack(which, 0, number, number) + payload


def named(first: int, count: int) -> bytes:
    """Poses of bodies called n0, n1, ..."""
    poses = FrameTransforms()
    for k in range(first, first + count):
        pose = poses.transforms.add()
        pose.parent_frame_id, pose.child_frame_id, pose.rotation.w = "world", f"n{k}", 1.0
    return poses.SerializeToString()


def with_records(data: bytes, change: Callable[[PARTS], PARTS]) -> bytes:
    """A file whose records are changed, without an index."""
    foot = int.from_bytes(data[-28:-20], "little") or len(data) - 37
    footer = HEAD.pack(Opcode.FOOTER, 20) + struct.pack("<QQI", 0, 0, 0)
    return data[:8] + joined(change(split(data[8:foot]))) + footer + data[:8]


def plus(*records: tuple[int, bytes]) -> Callable[[bytes], bytes]:
    return lambda data: with_records(data, lambda parts: [*parts[:-1], *records, parts[-1]])


def of_kind(opcode: int, change: Callable[[bytes], bytes]) -> Callable[[bytes], bytes]:
    """Change the content of the last record of a kind."""

    def changed(parts: PARTS) -> PARTS:
        k = max(k for k, (kind, _) in enumerate(parts) if kind == opcode)
        return [*parts[:k], (opcode, change(parts[k][1])), *parts[k + 1 :]]

    return lambda data: with_records(data, changed)


def of_messages(change: Callable[[int, bytes], bytes], which: int | None = None) -> Callable[[bytes], bytes]:
    """Change the content of messages of the last chunk, by their number: of all channels, or of one."""

    def changed(content_of_chunk: bytes) -> bytes:
        messages = []
        for k, (opcode, content) in enumerate(inside(content_of_chunk)):
            meant = opcode == Opcode.MESSAGE and which in (None, MESSAGE.unpack_from(content)[0])
            messages.append((opcode, change(k, content) if meant else content))
        return closed(joined(messages))

    return of_kind(Opcode.CHUNK, changed)


def of_heads(at: int, value: Callable[[int], int]) -> Callable[[bytes], bytes]:
    """Change a number of the head of every message: channel, sequence, log time or publish time."""

    def change(k: int, content: bytes) -> bytes:
        head = list(MESSAGE.unpack_from(content))
        head[at] = value(k)
        return MESSAGE.pack(*head) + content[MESSAGE.size :]

    return of_messages(change)


def of_poses(path: str, *values: object) -> Callable[[bytes], bytes]:
    """Set a field of every transform of the last chunk."""

    def change(_: int, content: bytes) -> bytes:
        poses = FrameTransforms()
        poses.ParseFromString(content[MESSAGE.size :])
        for pose, value in zip(poses.transforms, values * len(poses.transforms), strict=False):
            part, _, name = path.rpartition(".")
            setattr(getattr(pose, part) if part else pose, name, value)
        return content[: MESSAGE.size] + poses.SerializeToString()

    return of_messages(change, which=TF_CHANNEL)


def glb(words: dict, length: int | None = None) -> bytes:
    body = json.dumps(words).encode()
    body += b" " * (-len(body) % 4)
    size = 20 + len(body) if length is None else length
    return b"glTF" + struct.pack("<II", 2, size) + struct.pack("<I4s", len(body), b"JSON") + body


def listed(names: object) -> tuple[int, bytes]:
    return record(Metadata("vrlab.bodies", {"names": json.dumps(names)}))


def scene(words: bytes) -> tuple[int, bytes]:
    return attachment("scene.toml", words)


ENDLESS = {"accessors": [{"count": 2**40, "type": "VEC3", "componentType": 5126}], "scenes": [{"nodes": [0]}],
           "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}], "nodes": [{"mesh": 0}]}  # fmt: skip
LOOP = {"nodes": [{"children": [0]}], "scenes": [{"nodes": [0]}], "asset": {"version": "2.0"}}
EACH_OTHER = b'[[body]]\nid="body 0"\nparent="body 1"\n[[body]]\nid="body 1"\nparent="body 0"\n'
INSERTED = [
    listed([f"n{k}" for k in range(4097)]),
    listed(["body 0", "body 0"]),
    listed(["body 0"]),
    listed([1, 2]),
    listed(["", "body 0", "body 1"]),
    record(Metadata("vrlab.bodies", {"names": "[" * 100_000})),
    record(Metadata("vrlab.session", {"format": "vrlab/1", "pseudonym": "S01"})),
    record(Metadata("vrlab.session", {"\x1b[2J": "\x1b]0;own\x07", "a\nb": "\u202e"})),
    record(Metadata("vrlab.session", {"format": "vrlab/1", "consent": "x" * 10**6})),
    attachment("meshes/../../evil.glb", b"x"),
    attachment("meshes/body 1.glb", glb(ENDLESS)),
    attachment("meshes/body 1.glb", glb(LOOP)),
    attachment("meshes/body 1.glb", glb({}, 2**32 - 1)),
    scene(b"\xff\xfe\x00"),
    scene(EACH_OTHER),
    scene(b'[[body]]\nid="body 0"\nmesh="/etc/passwd"\n'),
    scene(b'[scene]\nspace_radius=nan\n[[body]]\nid="body 0"\n'),
    record(Channel(1, "/events", "protobuf", {}, 1)),
    record(Channel(1, "/tf", "protobuf", {}, 999)),
    record(Channel(900, "/hands//", "protobuf", {}, 1)),
    record(Channel(901, "/hands/\x1b[2J\u202e/l", "protobuf", {}, 1)),
    message(10**18, named(0, 2)),
    chunk([message(1, named(0, 300))]),
    (200, b"x"),
    (Opcode.CHUNK, b""),
    (Opcode.MESSAGE, b"\x01"),
]
"""Records that a file had better not hold."""

WRONG: dict[str, Callable[[bytes], bytes]] = {
    "nothing": lambda data: b"",
    "a damaged mark": lambda data: b"\x88" + data[1:],
    "zeros after the mark": lambda data: data[:8] + bytes(100_000),
    "two sessions in a row": lambda data: data * 2,
    "the second half": lambda data: data[len(data) // 2 :],
    "no footer": lambda data: data[:-37],
    "records in the wrong order": lambda data: with_records(data, lambda parts: [parts[0], *parts[:0:-1]]),
    "an index at byte 2^63": lambda data: data[:-28] + struct.pack("<Q", 2**63) + data[-20:],
    "poses in JSON": of_kind(Opcode.CHUNK, lambda c: closed(opened(c).replace(b"protobuf", b"protobad"))),
    "an unknown version": lambda data: data.replace(b"vrlab/1", b"vrlab/9"),
    "a chunk that unpacks to 2^63": of_kind(Opcode.CHUNK, lambda c: c[:16] + struct.pack("<Q", 2**63) + c[24:]),
    "a chunk with another checksum": of_kind(Opcode.CHUNK, lambda c: c[:24] + bytes(4) + b"1" + c[29:]),
    "a chunk packed by nobody knows what": of_kind(Opcode.CHUNK, lambda c: c.replace(b"zstd", b"tsdz", 1)),
    "a chunk in a chunk": of_kind(Opcode.CHUNK, lambda c: closed(joined([(Opcode.CHUNK, c)]))),
    "a body twice in a message": of_messages(lambda _, content: content + content[MESSAGE.size :]),
    "messages that are none": of_messages(lambda _, content: content[: MESSAGE.size] + b"\xff"),
    "messages of every channel": of_heads(0, lambda k: k % 12),
    "log times of 2^63": of_heads(2, lambda k: 2**63),
    "frames all at one time": of_heads(2, lambda k: 10**18),
    "frames backwards": of_heads(3, lambda k: 2 * 10**18 - k),
    "frames from 0 to 2^63 - 1": of_heads(3, lambda k: (0, 2**63 - 1)[k % 2]),
    "every place not a number": of_poses("translation.x", np.nan),
    "places of 1e308": of_poses("translation.z", 1e308, -1e308),
    "rotations of zero": of_poses("rotation.w", 0.0),
    "a body that is the world": of_poses("child_frame_id", "world"),
    "names of control characters": of_poses("child_frame_id", "\x1b[2J", "\u202e\n"),
    **{f"inserted record {k}": plus(record) for k, record in enumerate(INSERTED)},
}
"""What is wrong -> what it makes of a good file."""


# --- Draws over records ---


def redrawn(draw: st.DrawFn, opcode: int, content: bytes) -> tuple[int, bytes]:
    """A record with one thing in it drawn anew: a message of a chunk, a pose of a message, a number or a byte."""
    if opcode == Opcode.CHUNK and draw(st.booleans()) and (parts := inside(content)):
        return chunk(edited(draw, parts))
    poses = FrameTransforms()
    try:
        poses.ParseFromString(content[MESSAGE.size :] if opcode == Opcode.MESSAGE else b"")
    except DecodeError:
        poses.Clear()
    if poses.transforms and draw(st.booleans()):
        pose, word = poses.transforms[0], draw(st.sampled_from(TEXTS))
        value = draw(st.sampled_from([np.nan, np.inf, 1e308, -1e20, 0.0]))
        change = draw(st.sampled_from(["parent", "child", "place", "turn", "second", "more", "without"]))
        if change in ("parent", "child"):
            setattr(pose, f"{change}_frame_id", word)
        elif change == "second":
            pose.timestamp.seconds = draw(st.sampled_from([2**62, -(2**62), 9223372037, -1]))
        elif change == "more":
            poses.MergeFromString(named(0, draw(st.sampled_from([1, 50, 500]))))
        elif change == "without":
            pose.ClearField("rotation")
        else:
            {"place": pose.translation, "turn": pose.rotation}[change].x = value
        return opcode, content[: MESSAGE.size] + poses.SerializeToString()
    kind = draw(st.sampled_from(["<B", "<H", "<I", "<Q"]))
    size = struct.calcsize(kind)
    if len(content) < size:
        return opcode, content
    at = draw(st.integers(0, min(len(content) - size, 200)))
    value = draw(st.sampled_from(NUMBERS)) & ((1 << 8 * size) - 1)
    return opcode, content[:at] + struct.pack(kind, value) + content[at + size :]


def edited(draw: st.DrawFn, parts: PARTS) -> PARTS:
    """One record left out, doubled, moved, changed, or one more."""
    if not parts:
        return parts
    k, to = draw(st.integers(0, len(parts) - 1)), draw(st.integers(0, len(parts) - 1))
    action = draw(st.sampled_from(["change", "change", "change", "drop", "double", "swap", "insert"]))
    if action == "drop":
        return parts[:k] + parts[k + 1 :]
    if action == "double":
        return [*parts[:to], parts[k], *parts[to:]]
    if action == "insert":
        return [*parts[:k], draw(st.sampled_from(INSERTED)), *parts[k:]]
    changed = list(parts)
    if action == "swap":
        changed[k], changed[to] = parts[to], parts[k]
    else:
        changed[k] = redrawn(draw, *parts[k])
    return changed


@st.composite
def wrong_bytes(draw: st.DrawFn, files: dict[str, bytes]) -> bytes:
    """A good file with records changed, with or without its index, or with its bytes damaged."""
    data = files[draw(st.sampled_from(sorted(files)))]
    if draw(st.booleans()):
        return draw(damaged_below_checksums(data))
    foot = int.from_bytes(data[-28:-20], "little") or len(data) - 37
    parts, index = split(data[8:foot]), data[foot:]
    for _ in range(draw(st.integers(1, 3))):
        parts = edited(draw, parts)
    if draw(st.booleans()):  # the index as it was: its offsets are wrong now
        return data[:8] + joined(parts) + index
    footer = HEAD.pack(Opcode.FOOTER, 20) + struct.pack("<QQI", draw(st.sampled_from([0, *NUMBERS])), 0, 0)
    return data[:8] + joined(parts) + footer + data[:8]


# --- Small files that ask for much ---


def bodies(count: int) -> bytes:
    return b"".join(b'[[body]]\nid="b%d"\ntags=["x"]\n' % k for k in range(count))


def many_names(count: int, each: int = 5000) -> list[tuple[int, bytes]]:
    rows = [message(k, named(k * each, each)) for k in range(count // each)]
    return [chunk(rows[k : k + 50]) for k in range(0, len(rows), 50)]


BOMBS: dict[str, Callable[[], list[tuple[int, bytes]]]] = {
    "a million names": lambda: many_names(1_000_000),
    "two million empty messages": lambda: [chunk([message(5)] * 2_000_000)],
    "a scene of dots": lambda: [scene(b"a" + b".a" * 200_000 + b"=1\n")],
    "tags times tags": lambda: [
        scene(bodies(5000) + b'[[pair]]\nbetween=["tag:x", "tag:x"]\n' * 100)
    ],
    "a million tiny records": lambda: [(0x90, b"")] * 1_000_000,
}  # fmt: skip
"""Name -> records that a good file holds more."""


# --- What the verbs say ---

KNOWN = (SessionError, ReplayError, CollisionCoreError)
STRUCTURE = {"torn", "unreadable", "damaged-chunk", "bad-message"}


def answer(work: Callable[[], object]) -> tuple[bool, str]:
    try:
        return True, str(work() or "")
    except KNOWN as error:
        assert str(error).strip() and str(error).isprintable(), repr(str(error))
        return False, str(error)


def verbs(path: Path, out: Path) -> dict[str, tuple[bool, str]]:
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


def contradictions(data: bytes, folder: Path) -> list[str]:
    """What two verbs say of one file that cannot both be true, and files that they leave elsewhere."""
    path, out = folder / "wrong.mcap", folder / "out.mcap"
    path.write_bytes(data)
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        answers = verbs(path, out)
    yes = {verb: accepted for verb, (accepted, _) in answers.items()}
    words = {verb: sentence for verb, (_, sentence) in answers.items()}
    wrong = {
        "the doctor passes what info refuses": yes["doctor"] and not yes["info"],
        "the doctor passes what run refuses": yes["doctor"] and not yes["run"],
        "run accepts what info refuses": yes["run"] and not yes["info"],
        "info refuses what recover wrote": not yes.get("again", True),
        "the doctor sends what recover wrote to recover": not yes.get("healed", True),
        "nothing was lost or mended of a file that info refuses": (
            yes.get("whole", False) and not yes["info"] and "mended" not in words["recover"]
        ),
        "recover saves nothing of a file that info reads": yes["info"] and not yes["recover"],
        "the doctor sees no MCAP, recover saves some": "not-mcap" in words["doctor"] and yes["recover"],
    }
    elsewhere = [f"left {file.name}" for file in folder.iterdir() if file not in (path, out)]
    return [f"{sentence}: {answers}" for sentence, holds in wrong.items() if holds] + elsewhere
