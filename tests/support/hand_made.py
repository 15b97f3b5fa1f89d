"""Session files that are wrong in ways that nobody leaves to chance; each is made of a good one.

``PYTHONPATH=.:tests python -m support.hand_made FOLDER`` asks the four verbs about all of them.
"""

import gzip
import json
import struct
import sys
import time
import warnings
import zipfile
from collections.abc import Callable
from io import BytesIO
from pathlib import Path

import lz4.frame
import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from mcap.opcode import Opcode
from support.bombs import _added, _chunks, _named, _scene, _tf
from support.damage import CHUNK, HEAD
from support.hostile import MET, _with_messages, _with_records, contradictions, good_files, verbs
from support.hostile_files import MESSAGE, closed, joined, opened, table, text

Parts = list[tuple[int, bytes]]


def _record(opcode: int, change: Callable[[bytes], bytes]) -> Callable[[bytes], bytes]:
    """Change the content of the first record of a kind."""

    def changed(parts: Parts) -> Parts:
        k = next(k for k, (found, _) in enumerate(parts) if found == opcode)
        return [*parts[:k], (opcode, change(parts[k][1])), *parts[k + 1 :]]

    return lambda data: _with_records(data, changed)


def _chunk(first: int, value: int, kind: str = "<Q") -> Callable[[bytes], bytes]:
    """One number in the head of the first chunk becomes another."""
    return _record(Opcode.CHUNK, lambda c: c[:first] + struct.pack(kind, value) + c[first + struct.calcsize(kind) :])


TF_CHANNEL = 1  # The first channel that a session file declares


def _poses(change: Callable[[FrameTransforms], object]) -> Callable[[bytes], bytes]:
    """Change every message of poses in the last chunk."""

    def one(part: tuple[int, bytes]) -> tuple[int, bytes]:
        if part[0] != Opcode.MESSAGE or MESSAGE.unpack_from(part[1])[0] != TF_CHANNEL:
            return part
        message = FrameTransforms()
        message.ParseFromString(part[1][MESSAGE.size :])
        change(message)
        return part[0], part[1][: MESSAGE.size] + message.SerializeToString()

    return lambda data: _with_messages(data, lambda parts: [one(part) for part in parts])


def _each(name: str, *values: object) -> Callable[[FrameTransforms], None]:
    """Set a field, by its path, of every transform."""

    def change(message: FrameTransforms) -> None:
        for one, value in zip(message.transforms, values * len(message.transforms), strict=False):
            *path, last = name.split(".")
            for word in path:
                one = getattr(one, word)
            setattr(one, last, value)

    return change


def _heads(at: int, values: Callable[[int], int]) -> Callable[[bytes], bytes]:
    """Change one number in the heads of all messages of the last chunk."""

    def change(parts: Parts) -> Parts:
        made = []
        for k, (opcode, content) in enumerate(parts):
            head = list(MESSAGE.unpack_from(content))
            head[at] = values(k)
            made.append((opcode, MESSAGE.pack(*head) + content[MESSAGE.size :]))
        return made

    return lambda data: _with_messages(data, change)


def _metadata(name: str, values: dict[str, str]) -> Callable[[bytes], bytes]:
    return lambda data: _added(data, [(Opcode.METADATA, text(name) + table(values))])


def _attached(name: str, inside: bytes, length: int | None = None) -> Callable[[bytes], bytes]:
    size = struct.pack("<Q", len(inside) if length is None else length)
    return lambda data: _added(
        data, [(Opcode.ATTACHMENT, bytes(16) + text(name) + text("x") + size + inside + bytes(4))]
    )


def _channel(number: int, topic: str, encoding: str = "protobuf", schema: int = 1) -> tuple[int, bytes]:
    return Opcode.CHANNEL, struct.pack("<HH", number, schema) + text(topic) + text(encoding) + bytes(4)


def _nested(data: bytes) -> bytes:
    """A chunk in a chunk."""

    def change(parts: Parts) -> Parts:
        k = next(k for k, (opcode, _) in enumerate(parts) if opcode == Opcode.CHUNK)
        return [*parts[:k], (Opcode.CHUNK, closed([parts[k]], 0, 2**62)), *parts[k + 1 :]]

    return _with_records(data, change)


def _zip(data: bytes) -> bytes:
    file = BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("../../session.mcap", data)
    return file.getvalue()


def _glb(words: dict, length: int | None = None) -> bytes:
    body = json.dumps(words).encode()
    body += b" " * (-len(body) % 4)
    size = 20 + len(body) if length is None else length
    return b"glTF" + struct.pack("<II", 2, size) + struct.pack("<I4s", len(body), b"JSON") + body


def _without(*opcodes: int) -> Callable[[bytes], bytes]:
    return lambda data: _with_records(data, lambda parts: [one for one in parts if one[0] not in opcodes])


BOMB_GLB = _glb({"accessors": [{"count": 2**40, "type": "VEC3", "componentType": 5126}], "meshes": [{"primitives": [
    {"attributes": {"POSITION": 0}}]}], "nodes": [{"mesh": 0}], "scenes": [{"nodes": [0]}]})  # fmt: skip
LOOP_GLB = _glb({"nodes": [{"children": [0]}], "scenes": [{"nodes": [0]}], "asset": {"version": "2.0"}})

HOSTILE_FACTS = {"format": "vrlab/1", "\x1b[2J": "\x1b]0;own\x07", "a\nb": "\u202e"}

OWN: dict[str, Callable[[bytes], bytes]] = {
    "nothing": lambda data: b"",
    "half a mark": lambda data: data[:4],
    "the mark alone": lambda data: data[:8],
    "both marks and nothing between": lambda data: data[:8] * 2,
    "ten thousand marks": lambda data: data[:8] * 10_000,
    "zeros": lambda data: bytes(100_000),
    "zeros after the mark": lambda data: data[:8] + bytes(100_000),
    "text": lambda data: b"time,body,x,y,z\n" * 99,
    "packed by gzip": lambda data: gzip.compress(data),
    "a ZIP that climbs": _zip,
    "two sessions in a row": lambda data: data * 2,
    "a session in a session's place of records": lambda data: data[:-37] + data,
    "the end first": lambda data: data[::-1],
    "the second half": lambda data: data[len(data) // 2 :],
    "a megabyte behind the end": lambda data: data + bytes(10**6),
    "no end mark": lambda data: data[:-8],
    "no footer": lambda data: data[:-37],
    "no header": _without(Opcode.HEADER),
    "two headers": lambda data: _with_records(data, lambda parts: [parts[0], *parts]),
    "no channel and no schema": _without(Opcode.CHANNEL, Opcode.SCHEMA),
    "no metadata": _without(Opcode.METADATA),
    "no chunk": _without(Opcode.CHUNK),
    "no attachment": _without(Opcode.ATTACHMENT),
    "every record twice": lambda data: _with_records(data, lambda parts: [one for one in parts for _ in range(2)]),
    "records in the wrong order": lambda data: _with_records(data, lambda parts: [parts[0], *parts[:0:-1]]),
    "a record of 2^63 bytes": lambda data: data[:8] + HEAD.pack(Opcode.METADATA, 2**63) + data[8:],
    "a record of 2^64 - 1 bytes last": lambda data: data[:-37] + HEAD.pack(Opcode.CHUNK, 2**64 - 1),
    "records of all other kinds": lambda data: _added(data, [(k, bytes(k)) for k in range(16, 256)]),
    "a chunk that unpacks to 2^63": _chunk(16, 2**63),
    "a chunk that unpacks to less": _chunk(16, 10),
    "a chunk from 2^64 - 1 to 0": _chunk(0, 2**64 - 1),
    "a chunk with another checksum": _chunk(24, 12345, "<I"),
    "a chunk with no checksum": _chunk(24, 0, "<I"),
    "a chunk packed by nobody knows what": _record(Opcode.CHUNK, lambda c: c.replace(b"zstd", b"tsdz", 1)),
    "a chunk that says lz4 and is zstd": _record(
        Opcode.CHUNK, lambda c: c[:28] + text("lz4") + c[CHUNK.size + 4 :]
    ),
    "an lz4 chunk of zeros": lambda data: _added(data, [(Opcode.CHUNK, CHUNK.pack(0, 1, 10**8, 0, 3) + b"lz4" + (
        lambda packed: struct.pack("<Q", len(packed)) + packed)(lz4.frame.compress(bytes(10**8))))]),
    "a chunk in a chunk": _nested,
    "a channel declared as another": lambda data: _added(data, [_channel(1, "/events"), _channel(1, "/tf")]),
    "a channel of a schema that there is not": lambda data: _added(data, [_channel(1, "/tf", schema=999)]),
    "hands of nobody": lambda data: _added(data, [_channel(900, "/hands//")]),
    "a topic of control characters": lambda data: _added(data, [_channel(901, "/hands/\x1b[2J\u202e/l")]),
    "a name that climbs": _attached("meshes/../../evil.glb", b"x"),
    "a mesh of 2^40 corners": _attached("meshes/body 1.glb", BOMB_GLB),
    "a mesh whose node is its own child": _attached("meshes/body 1.glb", LOOP_GLB),
    "a mesh that says it is longer": _attached("meshes/body 1.glb", _glb({}, 2**32 - 1)),
    "an attachment of 2^63 bytes": _attached("notes", b"x", 2**63),
    "a scene of bytes": lambda data: _scene(data, b"\xff\xfe\x00"),
    "a scene whose bodies hold each other": lambda data: _scene(
        data, b'[[body]]\nid="body 0"\nparent="body 1"\n[[body]]\nid="body 1"\nparent="body 0"\n'
    ),
    "a scene with a mesh elsewhere": lambda data: _scene(data, b'[[body]]\nid="body 0"\nmesh="/etc/passwd"\n'),
    "a scene of nan": lambda data: _scene(data, b'[scene]\nspace_radius=nan\n[[body]]\nid="body 0"\n'),
    "facts twice": _metadata("vrlab.session", {"format": "vrlab/1", "pseudonym": "S01"}),
    "facts that command": _metadata("vrlab.session", HOSTILE_FACTS),
    "a fact of a megabyte": _metadata("vrlab.session", {"format": "vrlab/1", "consent": "x" * 10**6}),
    "bodies of no name": _metadata("vrlab.bodies", {"names": '["", "body 0", "body 1"]'}),
    "bodies that are numbers": _metadata("vrlab.bodies", {"names": "[1, 2]"}),
    "bodies nested too deep": _metadata("vrlab.bodies", {"names": "[" * 100_000}),
    "every place not a number": _poses(_each("translation.x", np.nan)),
    "every place infinite": _poses(_each("translation.y", np.inf, -np.inf)),
    "places of 1e308": _poses(_each("translation.z", 1e308, -1e308)),
    "rotations of zero": _poses(_each("rotation.w", 0.0)),
    "rotations of 1e200": _poses(_each("rotation.x", 1e200)),
    "a body that is the world": _poses(_each("child_frame_id", "world")),
    "a body under itself": _poses(_each("parent_frame_id", "body 0", "body 1")),
    "names of control characters": _poses(_each("child_frame_id", "\x1b[2J", "\u202e\n")),
    "a name of 5,000 letters": _poses(_each("child_frame_id", "x" * 5000, "body 1")),
    "messages without a body": _poses(lambda message: message.ClearField("transforms")),
    "frames all at one time": _heads(2, lambda k: 10**18),
    "frames backwards": _heads(3, lambda k: 2 * 10**18 - k),
    "frames from 0 to 2^63 - 1": _heads(3, lambda k: (0, 2**63 - 1)[k % 2]),
    "messages of no channel": _heads(0, lambda k: 60_000),
    "messages of every channel": _heads(0, lambda k: k % 12),
    "messages all of one number": _heads(1, lambda k: 7),
    "4,096 bodies once": lambda data: _chunks(data, [_tf((1, 0, 1, 1), _named(0, 4094))]),
    "a message in no chunk": lambda data: _added(data, [_tf((1, 0, 10**18, 10**18), _named(0, 2))]),
    "records cut within a chunk": lambda data: _with_records(
        data, lambda parts: [
            (op, closed([*opened(c)[:3], (Opcode.MESSAGE, b"\x01")], 0, 2**62)) if op == Opcode.CHUNK else (op, c)
            for op, c in parts
        ]
    ),
    "chunks that are not packed": lambda data: data[:8] + joined(
        [one for part in _split_open(data) for one in part]) + data[-37:],
}  # fmt: skip
"""What is wrong -> what it makes of a good file."""


def _split_open(data: bytes) -> list[Parts]:
    from support.hostile_files import split

    foot = int.from_bytes(data[-28:-20], "little") or len(data) - 37
    return [
        opened(content) if opcode == Opcode.CHUNK else [(opcode, content)] for opcode, content in split(data[8:foot])
    ]


HAND_MADE = MET | OWN


def wrong_with(name: str, good: bytes, folder: Path) -> list[str]:
    """What the four verbs make of a file that cannot all be true, or takes too long, or lies elsewhere."""
    path, out = folder / "made.mcap", folder / "out.mcap"
    path.write_bytes(HAND_MADE[name](good))
    began = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        found = verbs(path, out)
    wrong = contradictions(found)
    if time.process_time() - began > 4 * (2 + path.stat().st_size / 1e6):
        wrong.append("slow")
    wrong += [f"left {one.name}" for one in folder.iterdir() if one not in (path, out)]
    return [f"{name}: {one}: {found}" for one in wrong]


def main(folder: Path) -> int:
    """Ask about every file; the exit code says whether anything was wrong."""
    (folder / "work").mkdir(parents=True, exist_ok=True)
    good = good_files(folder)["own.mcap"]
    wrong = [one for name in HAND_MADE for one in wrong_with(name, good, folder / "work")]
    print(*wrong, f"{len(HAND_MADE)} files, {len(wrong)} wrong", sep="\n")
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
