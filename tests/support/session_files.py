"""Session files and files of other programs, written message by message and chunk by chunk."""

import json
import struct
from pathlib import Path

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from mcap.data_stream import RecordBuilder
from mcap.records import Message
from mcap.writer import CompressionType, Writer

from sessions.mcap.schemas import channel_spec
from sessions.mesh_data import MeshData
from sessions.model.session import Frames, Session, Status

COLUMNS = ("stamp_ns", "log_ns", "sample_ns", "position", "quaternion_xyzw", "status")
SECOND = 1_000_000_000


def assert_same_frames(a, b):
    """Every array equal bit for bit, NaN and negative zero included."""
    assert a.names == b.names
    for name in COLUMNS:
        left, right = getattr(a, name), getattr(b, name)
        assert left.dtype == right.dtype and left.shape == right.shape, name
        assert left.tobytes() == right.tobytes(), name


def random_frames(seed, count=50, bodies=3, *, absent=0.0, odd=0.0):
    """Frames at about 90 Hz with own device stamps; ``absent`` and ``odd`` are the shares of those statuses."""
    rng = np.random.default_rng(seed)
    stamp = 1_700_000_000 * SECOND + np.cumsum(rng.integers(2_300_000, 20_000_000, count))
    shape = (count, bodies)
    status = np.full(shape, Status.VALID, dtype=np.uint8)
    strange = rng.random(shape) < odd
    status[strange] = rng.integers(Status.LOST, Status.INTERPOLATED + 1, strange.sum())
    status[rng.random(shape) < absent] = Status.ABSENT
    gone = status == Status.ABSENT
    sample = np.where(gone, 0, stamp[:, None] - rng.integers(0, 22_000_000, shape))
    position, quaternion = rng.normal(size=(*shape, 3)), rng.normal(size=(*shape, 4))
    position[gone], quaternion[gone] = np.nan, np.nan
    names = tuple(f"body {column}" for column in range(bodies))
    return Frames(names, stamp, stamp + 700, sample, position, quaternion, status)


def session_of(frames, **fields):
    """A session of frames, without meshes unless given."""
    return Session(frames, fields.pop("meshes", {}), **fields)


def tetrahedron(size=0.1):
    """A closed mesh of four faces."""
    return MeshData(np.vstack([np.zeros(3), np.eye(3)]) * size, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


doubles = st.floats(width=64, allow_nan=True, allow_infinity=True) | st.sampled_from([0.0, -0.0, 1.0, 5e-324])
stamps = st.integers(0, 2**62) | st.integers(0, 300 * SECOND) | st.just(0)


@st.composite
def any_frames(draw):
    """Any layout: bodies missing, lost, held, NaN and zeros anywhere, stamps in any order, devices before zero."""
    names = tuple(draw(st.lists(st.text('a"\\\n\0ä\u202e杯🙂', max_size=6), max_size=4, unique=True)))
    count = draw(st.integers(0, 6))
    shape = (count, len(names))
    status = draw(hnp.arrays(np.uint8, shape, elements=st.integers(0, 4)))
    gone = status == Status.ABSENT
    sample = draw(hnp.arrays(np.int64, shape, elements=stamps | st.integers(-(2**62), -1)))
    position = draw(hnp.arrays(np.float64, (*shape, 3), elements=doubles))
    quaternion = draw(hnp.arrays(np.float64, (*shape, 4), elements=doubles))
    sample[gone], position[gone], quaternion[gone] = 0, np.nan, np.nan
    stamp = draw(hnp.arrays(np.int64, count, elements=stamps))
    log_ns = draw(hnp.arrays(np.int64, count, elements=stamps))
    return Frames(names, stamp, log_ns, sample, position, quaternion, status)


def protobuf_messages(frames, parent="world"):
    """(publish, log, payload) of each frame as the protobuf library writes it: zeros left out, shortest varints."""
    result = []
    for row in range(len(frames)):
        message = FrameTransforms()
        for column in np.flatnonzero(frames.status[row] != Status.ABSENT):
            item = message.transforms.add(parent_frame_id=parent, child_frame_id=frames.names[column])
            item.timestamp.seconds, item.timestamp.nanos = divmod(int(frames.sample_ns[row, column]), SECOND)
            p, q = frames.position[row, column].tolist(), frames.quaternion_xyzw[row, column].tolist()
            item.translation.x, item.translation.y, item.translation.z = p
            item.rotation.x, item.rotation.y, item.rotation.z, item.rotation.w = q
        result.append((int(frames.stamp_ns[row]), int(frames.log_ns[row]), message.SerializeToString()))
    return result


def write_foreign(path, messages, *, topic="/tf", schema=None, encoding="protobuf", profile="", **options):
    """An MCAP as another program writes it, with the `mcap` library."""
    with path.open("wb") as stream:
        writer = Writer(stream, compression=options.pop("compression", CompressionType.ZSTD), **options)
        writer.start(profile=profile, library="another program")
        spec = channel_spec("/tf")
        number = writer.register_schema(schema or spec.schema, "protobuf", spec.descriptor_set)
        channel = writer.register_channel(topic, encoding, number)
        other = writer.register_channel("/speech", "json", 0)
        writer.add_message(other, 1, b'{"word": "hello"}', 1)
        for publish, log, payload in messages:
            writer.add_message(channel, log, payload, publish)
        writer.finish()
    return path


def packed(record):
    """The bytes of a message record: channel, sequence, log and publish time, payload."""
    channel, sequence, log_ns, publish_ns, data = record
    builder = RecordBuilder()
    Message(channel, log_ns, data, publish_ns, sequence).write(builder)
    return builder.end()


def write_transforms(path, rows):
    """``rows``: (name, stamp in ns, position, quaternion xyzw), all in the frame ``world``."""
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = writer.register_schema("foxglove.FrameTransform", "jsonschema", b"{}")
        channel = writer.register_channel("/tf", "json", schema)
        for name, stamp, position, quaternion in rows:
            message = {
                "timestamp": {"sec": stamp // 10**9, "nsec": stamp % 10**9},
                "parent_frame_id": "world",
                "child_frame_id": name,
                "translation": dict(zip("xyz", map(float, position), strict=True)),
                "rotation": dict(zip("xyzw", map(float, quaternion), strict=True)),
            }
            writer.add_message(channel, stamp, json.dumps(message).encode(), stamp)
        writer.finish()
    return path


def chunk(tag, content):
    """A chunk of an XDF file."""
    return b"\x04" + struct.pack("<I", len(content) + 2) + struct.pack("<H", tag) + content


def stream_header(number, name, kind, channels, form="double64"):
    """A stream's description; ``channels``: the elements of each."""
    desc = "".join(
        "<channel>" + "".join(f"<{key}>{value}</{key}>" for key, value in item.items()) + "</channel>"
        for item in channels
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
    """Chunks of an XDF file that state clock offsets (at, seconds) of a stream."""
    return b"".join(chunk(4, struct.pack("<Idd", number, at, value)) for at, value in pairs)


def xdf_file(folder: Path, *chunks: bytes) -> Path:
    """The path of an XDF file with these chunks."""
    path = folder / "take.xdf"
    path.write_bytes(b"XDF:" + chunk(1, b'<?xml version="1.0"?><info><version>1.0</version></info>') + b"".join(chunks))
    return path


TRANSFORM_OUTLET = [
    *({"label": label, "unit": "unit quaternion", "type": "quaternion component"} for label in "xyzw"),
    *({"label": label, "unit": "degree", "type": "axis angle"} for label in "xyz"),
    *({"label": label, "unit": "meter", "type": "position in world space"} for label in "xyz"),
]
"""Channels of LSL4Unity's transform outlet."""
