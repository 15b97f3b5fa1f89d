"""The records of a session file, changed as a hostile writer can, and what can happen to the bytes of any file."""

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
MESSAGE = struct.Struct("<HIQQ")


def records(data):
    """(opcode, start, end) of every record of a whole file."""
    at, found = 8, []
    while at + HEAD.size <= len(data) - 8:
        opcode, length = HEAD.unpack_from(data, at)
        found.append((opcode, at, at + HEAD.size + length))
        at = found[-1][2]
    return found


def chunks(data):
    """(start, end) of every chunk record."""
    return [(start, end) for opcode, start, end in records(data) if opcode == Opcode.CHUNK]


def split(data):
    """(opcode, content) of records in a row."""
    around = bytes(8)
    return [(opcode, data[start - 8 + HEAD.size : end - 8]) for opcode, start, end in records(around + data + around)]


def joined(parts):
    return b"".join(HEAD.pack(opcode, len(content)) + content for opcode, content in parts)


def opened(content):
    """What a chunk packed by zstd holds, or nothing."""
    at = CHUNK.size + CHUNK.unpack_from(content)[4]
    if content[CHUNK.size : at] != b"zstd":
        return b""
    return zstandard.ZstdDecompressor().decompress(content[at + 8 :], max_output_size=64 << 20)


def closed(plain):
    """The content of a chunk that holds these bytes, its checksum right."""
    packed = zstandard.ZstdCompressor(level=1).compress(plain)
    head = CHUNK.pack(0, 2**62, len(plain), zlib.crc32(plain), 4)
    return head + b"zstd" + struct.pack("<Q", len(packed)) + packed


def body_and_index(data):
    """The records of a file before its index, and the bytes from there on."""
    foot = int.from_bytes(data[-28:-20], "little") or len(data) - 37
    return split(data[8:foot]), data[foot:]


def without_index(parts, mark, index_at=0):
    """A file of these records whose footer names no index, or one at a byte where there is none."""
    footer = HEAD.pack(Opcode.FOOTER, 20) + struct.pack("<QQI", index_at, 0, 0)
    return mark + joined(parts) + footer + mark


def with_records(data, change):
    """A file whose records are changed, without an index."""
    return without_index(change(body_and_index(data)[0]), data[:8])


def with_messages(data, change, channel=None):
    """A file whose messages in chunks are changed, of all channels or of one: content -> content."""

    def changed(content):
        parts = split(opened(content))
        messages = [
            (kind, change(one) if kind == Opcode.MESSAGE and channel in (None, MESSAGE.unpack_from(one)[0]) else one)
            for kind, one in parts
        ]
        return closed(joined(messages))

    return with_records(
        data, lambda parts: [(kind, changed(one) if kind == Opcode.CHUNK else one) for kind, one in parts]
    )


def flipped(data, first, last, count, seed):
    """``count`` bytes between two places changed, every one to something else."""
    random = np.random.default_rng(seed)
    changed = bytearray(data)
    for at in random.choice(np.arange(first, last), min(count, last - first), replace=False).tolist():
        changed[at] ^= int(random.integers(1, 256))
    return bytes(changed)


@st.composite
def damaged(draw, data):
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
def damaged_below_checksums(draw, data):
    """As `damaged`; in half of the session files it is one chunk's messages, and the checksum agrees again."""
    places = chunks(data) if data.startswith(b"\x89MCAP") else []
    if not places or draw(st.booleans()):
        return draw(damaged(data))
    start, end = draw(st.sampled_from(places))
    content = closed(draw(damaged(opened(data[start + HEAD.size : end]))))
    return data[:start] + HEAD.pack(Opcode.CHUNK, len(content)) + content + data[end:]
