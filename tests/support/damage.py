"""Session files and what can happen to their bytes; half of the damage is made to pass the first checksum."""

import struct
import zlib

import numpy as np
import zstandard
from mcap.opcode import Opcode

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
