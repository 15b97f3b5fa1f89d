"""Session files and what can happen to their bytes; half of the damage is made to pass the first checksum."""

import struct
import zlib

import numpy as np
import zstandard
from mcap.opcode import Opcode

EXTREMES = [0, 1, 2**31 - 1, 2**32 - 1, 2**53, 2**63 - 1, 2**64 - 1]
HEAD = struct.Struct("<BQ")
CHUNK = struct.Struct("<QQQII")


def records(data: bytes):
    """(opcode, start, end) of every record of a whole file."""
    at, found = 8, []
    while at + HEAD.size <= len(data) - 8:
        opcode, length = HEAD.unpack_from(data, at)
        found.append((opcode, at, at + HEAD.size + length))
        at = found[-1][2]
    return found


def chunks(data: bytes):
    """(start, end) of every chunk record."""
    return [(start, end) for opcode, start, end in records(data) if opcode == Opcode.CHUNK]


def flipped(data: bytes, first: int, last: int, count: int, seed: int) -> bytes:
    """``count`` bytes between two places changed, every one to something else."""
    random = np.random.default_rng(seed)
    changed = bytearray(data)
    for at in random.choice(np.arange(first, last), min(count, last - first), replace=False).tolist():
        changed[at] ^= int(random.integers(1, 256))
    return bytes(changed)


def with_chunk(data: bytes, number: int, change) -> bytes:
    """One chunk's messages changed by a function of its bytes, its checksum made to agree again."""
    start, end = chunks(data)[number]
    first, last, _, _, name = CHUNK.unpack_from(data, start + HEAD.size)
    at = start + HEAD.size + CHUNK.size + name
    packed = data[at + 8 : at + 8 + int.from_bytes(data[at : at + 8], "little")]
    plain = change(zstandard.ZstdDecompressor().decompress(packed, max_output_size=64 << 20))
    again = zstandard.ZstdCompressor(level=1).compress(plain)
    body = CHUNK.pack(first, last, len(plain), zlib.crc32(plain), 4) + b"zstd" + struct.pack("<Q", len(again)) + again
    return data[:start] + HEAD.pack(Opcode.CHUNK, len(body)) + body + data[end:]


def mutated(data: bytes, random: np.random.Generator) -> bytes:
    """One to four changes, one after the other."""
    for _ in range(int(random.integers(1, 5))):
        if not data:
            return data
        data = CHANGES[int(random.integers(len(CHANGES)))](data, random)
    return data


def _span(data: bytes, random: np.random.Generator) -> tuple[int, int]:
    start = int(random.integers(len(data)))
    return start, min(len(data), start + int(random.integers(1, 200)))


def _flip(data: bytes, random: np.random.Generator) -> bytes:
    changed = bytearray(data)
    for at in random.integers(0, len(data), int(random.integers(1, 30))).tolist():
        changed[at] ^= 1 << int(random.integers(8))
    return bytes(changed)


def _cut(data: bytes, random: np.random.Generator) -> bytes:
    return data[: int(random.integers(len(data)))]


def _remove(data: bytes, random: np.random.Generator) -> bytes:
    start, end = _span(data, random)
    return data[:start] + data[end:]


def _repeat(data: bytes, random: np.random.Generator) -> bytes:
    start, end = _span(data, random)
    return data[:end] + data[start:end] * int(random.integers(1, 20)) + data[end:]


def _noise(data: bytes, random: np.random.Generator) -> bytes:
    start, end = _span(data, random)
    return data[:start] + random.bytes(end - start) + data[end:]


def _extreme(data: bytes, random: np.random.Generator) -> bytes:
    """A number of four or eight bytes somewhere becomes one that no file means."""
    kind = "<I" if random.random() < 0.5 else "<Q"
    size = struct.calcsize(kind)
    at = int(random.integers(max(1, len(data) - size)))
    if random.random() < 0.5 and data[:5] == b"\x89MCAP":
        starts = [start + 1 for _, start, _ in records(data)] or [at]
        at, kind, size = int(random.choice(starts)), "<Q", 8
    value = EXTREMES[int(random.integers(len(EXTREMES)))] & ((1 << 8 * size) - 1)
    return data[:at] + struct.pack(kind, value) + data[at + size :]


CHANGES = [_flip, _flip, _cut, _remove, _repeat, _noise, _extreme]
