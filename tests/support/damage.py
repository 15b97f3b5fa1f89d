"""The records of a session file, and what can happen to the bytes of any file."""

import struct
import zlib

import numpy as np
import zstandard
from hypothesis import strategies as st
from mcap.opcode import Opcode

EXTREMES = [0, 1, 2**31 - 1, 2**32 - 1, 2**53, 2**63 - 1, 2**64 - 1]
"""Numbers that no file means."""
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


def opened(content: bytes) -> bytes:
    """What a chunk packed by zstd holds, or nothing."""
    at = CHUNK.size + CHUNK.unpack_from(content)[4]
    if content[CHUNK.size : at] != b"zstd":
        return b""
    return zstandard.ZstdDecompressor().decompress(content[at + 8 :], max_output_size=64 << 20)


def closed(plain: bytes) -> bytes:
    """The content of a chunk that holds these bytes, its checksum right."""
    packed = zstandard.ZstdCompressor(level=1).compress(plain)
    head = CHUNK.pack(0, 2**62, len(plain), zlib.crc32(plain), 4)
    return head + b"zstd" + struct.pack("<Q", len(packed)) + packed


@st.composite
def damaged(draw: st.DrawFn, data: bytes) -> bytes:
    """One to four times bytes are written over, put in, repeated or lost."""
    for _ in range(draw(st.integers(1, 4))):
        start = draw(st.integers(0, len(data)))
        end = min(len(data), start + draw(st.integers(0, 200)))
        noise = draw(st.binary(min_size=1, max_size=20))
        number = struct.pack("<Q", draw(st.sampled_from(EXTREMES)))[: draw(st.sampled_from([4, 8]))]
        start, put, end = draw(
            st.sampled_from(
                [
                    (start, noise, start + len(noise)),
                    (start, number, start + len(number)),
                    (start, noise, start),
                    (start, 5 * data[start:end], start),
                    (start, b"", end),
                    (start, b"", len(data)),
                ]
            )
        )
        data = data[:start] + put + data[end:]
    return data


@st.composite
def damaged_below_checksums(draw: st.DrawFn, data: bytes) -> bytes:
    """As `damaged`; in half of the session files it is one chunk's messages, and the checksum agrees again."""
    places = chunks(data) if data.startswith(b"\x89MCAP") else []
    if not places or draw(st.booleans()):
        return draw(damaged(data))
    start, end = draw(st.sampled_from(places))
    content = closed(draw(damaged(opened(data[start + HEAD.size : end]))))
    return data[:start] + HEAD.pack(Opcode.CHUNK, len(content)) + content + data[end:]
