"""Recordings that are wrong on purpose: made by somebody who knows the format, one file per number for ever."""

import json
import struct
import zlib
from collections.abc import Callable

import numpy as np
import zstandard
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from google.protobuf.message import DecodeError
from mcap.opcode import Opcode
from support.damage import CHUNK, HEAD
from support.fuzzing import mutated

MESSAGE = struct.Struct("<HIQQ")
NUMBERS = [0, 1, 7, 255, 2**16 - 1, 2**31, 2**32 - 1, 2**62, 2**63 - 1, 2**63, 2**64 - 1]
TEXTS = ["", "../../x", "a\nb", "\x1b[31mred", "\u202eevil", "x" * 5000, "<script>alert(1)</script>", "\0", "/tf"]


# --- Files as lists of records: what a hostile writer has in hand ---


def split(data: bytes, start: int = 0) -> list[tuple[int, bytes]]:
    """(opcode, content) of the records in a row."""
    found = []
    while start + HEAD.size <= len(data):
        opcode, length = HEAD.unpack_from(data, start)
        found.append((opcode, data[start + HEAD.size : start + HEAD.size + length]))
        start += HEAD.size + length
    return found


def joined(parts) -> bytes:
    return b"".join(HEAD.pack(opcode, len(content)) + content for opcode, content in parts)


def opened(content: bytes) -> list[tuple[int, bytes]]:
    """The records of a chunk."""
    name = CHUNK.unpack_from(content)[4]
    at = CHUNK.size + name
    packed = content[at + 8 :]
    word = content[CHUNK.size : at]
    if word == b"zstd":
        packed = zstandard.ZstdDecompressor().decompress(packed, max_output_size=64 << 20)
    return split(packed)


def closed(parts, first: int, last: int) -> bytes:
    """The content of a chunk record, its checksum right."""
    plain = joined(parts)
    packed = zstandard.ZstdCompressor(level=1).compress(plain)
    head = CHUNK.pack(first, last, len(plain), zlib.crc32(plain), 4)
    return head + b"zstd" + struct.pack("<Q", len(packed)) + packed


def text(word: str) -> bytes:
    data = word.encode("utf-8", "replace")
    return struct.pack("<I", len(data)) + data


def table(values: dict[str, str]) -> bytes:
    inside = b"".join(text(key) + text(value) for key, value in values.items())
    return struct.pack("<I", len(inside)) + inside


# --- One change to a list of records ---


def _pick(parts, random, *opcodes) -> int | None:
    places = [k for k, (opcode, _) in enumerate(parts) if not opcodes or opcode in opcodes]
    return int(random.choice(places)) if places else None


def _drop(parts, random):
    k = _pick(parts, random)
    return parts[:k] + parts[k + 1 :]


def _double(parts, random):
    k, to = _pick(parts, random), _pick(parts, random)
    return [*parts[:to], parts[k], *parts[to:]]


def _swap(parts, random):
    a, b = sorted((_pick(parts, random), _pick(parts, random)))
    return parts if a == b else [*parts[:a], parts[b], *parts[a + 1 : b], parts[a], *parts[b + 1 :]]


def _content(parts, random):
    """One record's content damaged, its length kept true."""
    k = _pick(parts, random)
    return [*parts[:k], (parts[k][0], mutated(parts[k][1], random)), *parts[k + 1 :]]


def _number(parts, random):
    """One number at the start of a record becomes an extreme one."""
    k = _pick(parts, random)
    opcode, content = parts[k]
    kind = ("<H", "<I", "<Q")[int(random.integers(3))]
    size = struct.calcsize(kind)
    places = list(range(min(len(content) - size, 60) + 1))
    if not places:
        return parts
    at, value = int(random.choice(places)), NUMBERS[int(random.integers(len(NUMBERS)))]
    changed = content[:at] + struct.pack(kind, value & ((1 << 8 * size) - 1)) + content[at + size :]
    return [*parts[:k], (opcode, changed), *parts[k + 1 :]]


def _schema(parts, random):
    k = _pick(parts, random, Opcode.CHANNEL)
    if k is None:
        return parts
    number = struct.unpack_from("<H", parts[k][1])[0]
    topic = ["/tf", "/tracking", "/events", "/hands/a/left", "/x", "/tf"][int(random.integers(6))]
    encoding = ["protobuf", "json", "ros1", ""][int(random.integers(4))]
    schema = int(random.integers(0, 4))
    content = struct.pack("<HH", number, schema) + text(topic) + text(encoding) + table({})
    return [*parts[:k], (Opcode.CHANNEL, content), *parts[k + 1 :]]


def _bodies(parts, random):
    many = [f"n{k}" for k in range(int(random.choice([3, 4096, 4097, 20_000])))]
    choices = [["a", "a"], many, "text", [1, 2], None, [], [TEXTS[int(random.integers(len(TEXTS)))]], ["body 0"]]
    names = json.dumps(choices[int(random.integers(len(choices)))])
    values = {"names": names if random.random() < 0.8 else names[:-1]}
    content = text("vrlab.bodies") + table(values)
    k = _pick(parts, random, Opcode.METADATA)
    return parts if k is None else [*parts[: k + 1], (Opcode.METADATA, content), *parts[k + 1 :]]


def _facts(parts, random):
    word = TEXTS[int(random.integers(len(TEXTS)))]
    key = ["mesh.sha256/body 1", "mesh.sha256/ghost", "format", "pseudonym", word][int(random.integers(5))]
    content = text("vrlab.session") + table({key: word, "clock": word})
    k = _pick(parts, random, Opcode.METADATA)
    return parts if k is None else [*parts[: k + 1], (Opcode.METADATA, content), *parts[k + 1 :]]


def _profile(parts, random):
    word = ["vrlab/2", "vrlab/", "vrlab/99999999999", "", "ros2", "vrlab/1"][int(random.integers(6))]
    return [(Opcode.HEADER, text(word) + text("library")), *parts[1:]]


def _attached(parts, random):
    name = ["scene.toml", "meshes/body 1.glb", "meshes/../x.glb", "meshes/.glb"][int(random.integers(4))]
    data = [b"", b"\xff\xfe", b"glTF" + bytes(20), b"[[body]]\nid='q'\n", b"a.a.a.a.a=1", b"[[body]]\n" * 3,
            b"[[body]]\nid='body 1'\nparent='body 1'\n", b"[[body]]\nid='body 1'\nparent='ghost'\n"]  # fmt: skip
    inside = data[int(random.integers(len(data)))]
    content = struct.pack("<QQ", 0, 0) + text(name) + text("x") + struct.pack("<Q", len(inside)) + inside
    content += struct.pack("<I", zlib.crc32(content) if random.random() < 0.7 else 0)
    k = _pick(parts, random, Opcode.ATTACHMENT)
    keep = 0 if k is None else int(random.integers(2))
    at = 1 if k is None else k
    return [*parts[:at], (Opcode.ATTACHMENT, content), *parts[at + keep :]]


def _messages(parts, random):
    """Messages of one chunk changed, the chunk closed again with a true checksum."""
    k = _pick(parts, random, Opcode.CHUNK)
    if k is None:
        return parts
    first, last = CHUNK.unpack_from(parts[k][1])[:2]
    try:
        inside = opened(parts[k][1])
    except zstandard.ZstdError:
        return parts
    for _ in range(int(random.integers(1, 4))):
        inside = inside and INSIDE[int(random.integers(len(INSIDE)))](inside, random)
    return [*parts[:k], (Opcode.CHUNK, closed(inside, first, last)), *parts[k + 1 :]]


# --- One change to the messages of a chunk ---


def _rewritten(parts, random, change):
    k = _pick(parts, random, Opcode.MESSAGE)
    if k is None or len(parts[k][1]) < MESSAGE.size:  # damaged by an earlier change
        return parts
    channel, sequence, log, publish = MESSAGE.unpack_from(parts[k][1])
    head, payload = change([channel, sequence, log, publish], parts[k][1][MESSAGE.size :])
    return [*parts[:k], (Opcode.MESSAGE, MESSAGE.pack(*head) + payload), *parts[k + 1 :]]


def _stamp(parts, random):
    at, value = int(random.integers(4)), NUMBERS[int(random.integers(len(NUMBERS)))]

    def change(head, payload):
        head[at] = value & ((1 << (16, 32, 64, 64)[at]) - 1)
        return head, payload

    return _rewritten(parts, random, change)


def _many(message, count):
    for k in range(count):
        one = message.transforms.add()
        one.parent_frame_id, one.child_frame_id, one.rotation.w = "world", f"extra {k}", 1.0


TRANSFORMS: list[Callable] = [
    lambda message, one, word, random: message.transforms.add().CopyFrom(one),
    lambda message, one, word, random: setattr(one, "parent_frame_id", word),
    lambda message, one, word, random: setattr(one, "child_frame_id", word),
    lambda message, one, word, random: setattr(
        one.timestamp, "seconds", [2**62, -(2**62), 9223372037, -1][int(random.integers(4))]
    ),
    lambda message, one, word, random: setattr(
        one.translation, "x", [np.nan, np.inf, 1e308, -1e20][int(random.integers(4))]
    ),
    lambda message, one, word, random: one.ClearField("rotation"),
    lambda message, one, word, random: _many(message, [1, 50, 5000][int(random.integers(3))]),
]  # fmt: skip


def _transform(parts, random):
    change_one, word = TRANSFORMS[int(random.integers(7))], TEXTS[int(random.integers(len(TEXTS)))]

    def change(head, payload):
        message = FrameTransforms()
        try:
            message.ParseFromString(payload)
        except DecodeError:
            return head, payload
        if message.transforms:
            change_one(message, message.transforms[0], word, random)
        return head, message.SerializeToString()

    return _rewritten(parts, random, change)


def _payload(parts, random):
    data = [b"", b"{}", b"\xff" * 9, random.bytes(40), b'{"a": [1]}'][int(random.integers(5))]
    return _rewritten(parts, random, lambda head, payload: (head, data))


INSIDE = [_drop, _double, _swap, _content, _number, _stamp, _stamp, _transform, _transform, _transform, _payload]
CHANGES = [
    _drop, _double, _swap, _content, _number, _schema, _bodies, _facts, _profile, _attached,
    _messages, _messages, _messages, _messages, _messages,
]  # fmt: skip


def crafted(files: dict[str, bytes], number: int) -> bytes:
    """A mutant: half of them bytes damaged blindly, half made by somebody who knows the format."""
    random = np.random.default_rng([21, number])
    data = files[("own", "own", "live", "foreign", "lz4", "loose", "own")[int(random.integers(7))] + ".mcap"]
    if number % 2:
        return mutated(data, random)
    foot = int.from_bytes(data[-28:-20], "little")
    parts, index = split(data[8:foot]), data[foot:]
    for _ in range(int(random.integers(1, 3))):
        parts = parts and CHANGES[int(random.integers(len(CHANGES)))](parts, random)
    ending = int(random.integers(4))
    if ending == 0:  # the index as it was: its offsets are wrong now
        return data[:8] + joined(parts) + index
    start = NUMBERS[int(random.integers(len(NUMBERS)))] if ending == 1 else 0
    footer = HEAD.pack(Opcode.FOOTER, 20) + struct.pack("<QQI", start, 0, 0)
    return data[:8] + joined(parts) + footer + data[:8] * (ending != 2)
