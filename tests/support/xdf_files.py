"""XDF files written to the specification, chunk by chunk; pyxdf only reads them."""

import struct
from pathlib import Path


def chunk(tag, content):
    return b"\x04" + struct.pack("<I", len(content) + 2) + struct.pack("<H", tag) + content


def stream_header(number, name, kind, channels, form="double64"):
    """A stream's description; ``channels``: the elements of each."""
    desc = "".join(
        "<channel>" + "".join(f"<{key}>{value}</{key}>" for key, value in one.items()) + "</channel>"
        for one in channels
    )
    xml = (
        f'<?xml version="1.0"?><info><name>{name}</name><type>{kind}</type><channel_count>{max(1, len(channels))}'
        f"</channel_count><nominal_srate>0</nominal_srate><channel_format>{form}</channel_format>"
        f"<desc><channels>{desc}</channels></desc></info>"
    )
    return chunk(2, struct.pack("<I", number) + xml.encode())


def samples(number, stamps, rows):
    """Samples of a stream: texts, or rows of float64."""
    content = struct.pack("<I", number) + b"\x04" + struct.pack("<I", len(stamps))
    for stamp, row in zip(stamps, rows, strict=True):
        content += b"\x08" + struct.pack("<d", stamp)
        if isinstance(row, str):
            content += b"\x01" + bytes([len(row)]) + row.encode()
        else:
            content += struct.pack(f"<{len(row)}d", *row)
    return chunk(3, content)


def offsets(number, pairs):
    return b"".join(chunk(4, struct.pack("<Idd", number, at, value)) for at, value in pairs)


def xdf_file(folder: Path, *parts: bytes) -> Path:
    path = folder / "take.xdf"
    path.write_bytes(b"XDF:" + chunk(1, b'<?xml version="1.0"?><info><version>1.0</version></info>') + b"".join(parts))
    return path


TRANSFORM_OUTLET = [
    *({"label": one, "unit": "unit quaternion", "type": "quaternion component"} for one in "xyzw"),
    *({"label": one, "unit": "degree", "type": "axis angle"} for one in "xyz"),
    *({"label": one, "unit": "meter", "type": "position in world space"} for one in "xyz"),
]
"""Channels of LSL4Unity's transform outlet."""
