"""A clean session, and everything that can be wrong with one: planted singly or together, with what must be found."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from mcap.records import Attachment, Channel, Message, Metadata, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer
from support.small_worlds import cube

from sessions import Frames, MeshData, Session, Status, write_session

FRAMES = 900
STEP_NS = 11_111_111
START_NS = 1_700_000_000_000_000_000
BODIES = ("flask", "hand-left", "tray")
FIELDS = ("stamp_ns", "log_ns", "sample_ns", "position", "quaternion_xyzw", "status")


@dataclass
class Draft:
    """Arrays and meshes of a session that faults are planted in, and what is to be done to its file."""

    arrays: dict[str, np.ndarray]
    meshes: dict[str, MeshData]
    frames_of: dict[str, tuple[str, int, int]] = field(default_factory=dict)
    """Body -> (frame it is said to be given in, first and last row)."""
    hashes: dict[str, str] = field(default_factory=dict)
    """Body -> hash that the file states."""

    def session(self) -> Session:
        """As a session in memory."""
        return Session(Frames(BODIES, *(self.arrays[name].copy() for name in FIELDS)), self.meshes)

    def write(self, path: Path) -> Path:
        """As a file."""
        write_session(self.session(), path)
        if self.frames_of or self.hashes:
            rewrite(path, self)
        return path


@dataclass(frozen=True)
class Planted:
    """What must be found: code, body, and rows of the frames that the finding covers (``None``: no span)."""

    code: str
    body: str
    rows: tuple[int, int] | None

    def is_found(self, findings: list[Any], draft: Draft) -> bool:
        """Whether a finding says exactly this."""
        span = (None, None)
        if self.rows is not None:
            span = tuple(int(draft.arrays["stamp_ns"][row]) for row in self.rows)
        return any((one.code, one.body, (one.start_ns, one.end_ns)) == (self.code, self.body, span) for one in findings)


def clean() -> Draft:
    """Ten seconds: a flask carried about, a hand that swings and turns, a tray at rest."""
    stamps = START_NS + STEP_NS * np.arange(FRAMES)
    t = np.arange(FRAMES) / 90.0
    position = np.zeros((FRAMES, 3, 3))
    position[:, 0] = np.stack([0.3 * np.cos(0.7 * t), 1.0 + 0.1 * np.sin(1.3 * t), 0.3 * np.sin(0.7 * t)], axis=1)
    position[:, 1] = np.stack([0.4 * np.sin(1.1 * t), 1.2 + 0.2 * np.cos(0.9 * t), -0.4 + 0.1 * np.sin(2 * t)], axis=1)
    position[:, 2] = [0.0, 0.8, -0.3]
    quaternion = np.zeros((FRAMES, 3, 4))
    for body, rate in enumerate((0.5, 0.8, 0.0)):
        quaternion[:, body, 1], quaternion[:, body, 3] = np.sin(0.3 * np.sin(rate * t)), np.cos(0.3 * np.sin(rate * t))
    arrays = {
        "stamp_ns": stamps, "log_ns": stamps + 2_000_000, "sample_ns": np.repeat(stamps[:, None], 3, axis=1),
        "position": position, "quaternion_xyzw": quaternion,
        "status": np.full((FRAMES, 3), Status.VALID, dtype=np.uint8),
    }  # fmt: skip
    return Draft(arrays, {name: cube(0.1) for name in BODIES})


Fault = Callable[[Draft, int, int], Planted]


def nan_position(draft: Draft, body: int, at: int) -> Planted:
    draft.arrays["position"][at : at + 3, body, 1] = np.nan
    return Planted("not-finite", BODIES[body], (at, at + 2))


def zero_quaternion(draft: Draft, body: int, at: int) -> Planted:
    draft.arrays["quaternion_xyzw"][at, body] = 0.0
    return Planted("zero-quaternion", BODIES[body], (at, at))


def non_unit_quaternion(draft: Draft, body: int, at: int) -> Planted:
    draft.arrays["quaternion_xyzw"][at : at + 5, body] *= 1.1
    return Planted("non-unit-quaternion", BODIES[body], (at, at + 4))


def time_backwards(draft: Draft, body: int, at: int) -> Planted:
    for name in ("stamp_ns", "log_ns", "sample_ns"):
        draft.arrays[name][at : at + 4] -= 500_000_000
    return Planted("time-backwards", "", (at, at + 3))


def duplicate_stamps(draft: Draft, body: int, at: int) -> Planted:
    for name in ("stamp_ns", "log_ns", "sample_ns"):
        draft.arrays[name][at : at + 2] = draft.arrays[name][at - 1]
    return Planted("duplicate-stamps", "", (at, at + 1))


def gap(draft: Draft, body: int, at: int) -> Planted:
    for name in ("stamp_ns", "log_ns", "sample_ns"):
        draft.arrays[name][at:] += 1_000_000_000
    return Planted("gap", "", (at - 1, at))


def frozen(draft: Draft, body: int, at: int) -> Planted:
    for name in ("position", "quaternion_xyzw"):
        draft.arrays[name][at : at + 60, body] = draft.arrays[name][at - 1, body]
    return Planted("frozen", BODIES[body], (at, at + 59))


def teleport(size: float) -> Fault:
    """A jump of so many metres that stays."""

    def plant(draft: Draft, body: int, at: int) -> Planted:
        draft.arrays["position"][at:, body] += size * np.array([0.6, 0.0, 0.8])
        return Planted("teleport", BODIES[body], (at, at))

    return plant


def millimetres(draft: Draft, body: int, at: int) -> Planted:
    draft.arrays["position"][:, body] *= 1000.0
    return Planted("unit-suspect", BODIES[body], (0, FRAMES - 1))


def log_skew(draft: Draft, body: int, at: int) -> Planted:
    draft.arrays["log_ns"][at:] += 5_000_000_000
    return Planted("clock-skew", "", (at, FRAMES - 1))


def device_skew(draft: Draft, body: int, at: int) -> Planted:
    draft.arrays["sample_ns"][at:, body] -= 5_000_000_000
    return Planted("clock-skew", BODIES[body], (at, FRAMES - 1))


def unknown_frame(draft: Draft, body: int, at: int) -> Planted:
    draft.frames_of[BODIES[body]] = ("attic", at, at + 49)
    return Planted("unknown-frame", BODIES[body], (at, at + 49))


def mirrored_mesh(draft: Draft, body: int, at: int) -> Planted:
    mesh = draft.meshes[BODIES[body]]
    draft.meshes[BODIES[body]] = MeshData(mesh.vertices * [-1.0, 1.0, 1.0], mesh.faces)
    return Planted("mesh-mirrored", BODIES[body], None)


def wrong_hash(draft: Draft, body: int, at: int) -> Planted:
    draft.hashes[BODIES[body]] = "0" * 64
    return Planted("mesh-hash", BODIES[body], None)


def identity_while_lost(draft: Draft, body: int, at: int) -> Planted:
    draft.arrays["position"][at : at + 20, body] = 0.0
    draft.arrays["quaternion_xyzw"][at : at + 20, body] = [0.0, 0.0, 0.0, 1.0]
    return Planted("identity-while-lost", BODIES[body], (at, at + 19))


def out_of_space(draft: Draft, body: int, at: int) -> Planted:
    draft.arrays["position"][at : at + 2, body, 0] = 1e200, -1001.0
    return Planted("out-of-space", BODIES[body], (at, at + 1))


FAULTS: dict[str, Fault] = {
    "nan position": nan_position,
    "zero quaternion": zero_quaternion,
    "non-unit quaternion": non_unit_quaternion,
    "time backwards": time_backwards,
    "duplicate stamps": duplicate_stamps,
    "1 s gap": gap,
    "frozen pose": frozen,
    "teleport": teleport(0.5),
    "millimetres": millimetres,
    "5 s skew of the log": log_skew,
    "5 s skew of a device": device_skew,
    "unknown frame": unknown_frame,
    "mirrored mesh": mirrored_mesh,
    "wrong hash": wrong_hash,
    "identity while lost": identity_while_lost,
    "out of space": out_of_space,
}


def rewrite(path: Path, draft: Draft) -> None:
    """Write a file again through the mcap library, message by message, with frames renamed and hashes changed."""
    with path.open("rb") as stream:
        records = list(StreamReader(stream, emit_chunks=False).records)
    with path.open("wb") as stream:
        writer, row, channels = Writer(stream, compression=CompressionType.ZSTD), 0, {}
        writer.start("vrlab/1", "planted faults")
        for record in records:
            if isinstance(record, Schema) and record.id not in channels:
                channels[record.id] = writer.register_schema(record.name, record.encoding, record.data)
            elif isinstance(record, Channel) and record.topic not in channels:
                channels[record.topic] = writer.register_channel(
                    record.topic, record.message_encoding, channels[record.schema_id]
                )
                channels[-record.id] = record.topic
            elif isinstance(record, Attachment):
                writer.add_attachment(0, 0, record.name, record.media_type, record.data)
            elif isinstance(record, Metadata):
                stated = {f"mesh.sha256/{name}": value for name, value in draft.hashes.items()}
                changed = {key: stated.get(key, value) for key, value in record.metadata.items()}
                writer.add_metadata(record.name, changed)
            elif isinstance(record, Message):
                topic = channels[-record.channel_id]
                data = record.data
                if topic == "/tf":
                    data, row = renamed(data, draft, row), row + 1
                writer.add_message(channels[topic], record.log_time, data, record.publish_time, record.sequence)
        writer.finish()


def renamed(data: bytes, draft: Draft, row: int) -> bytes:
    """One message with the parents of some bodies renamed."""
    message = FrameTransforms.FromString(data)
    for one in message.transforms:
        parent, first, last = draft.frames_of.get(one.child_frame_id, ("", 0, -1))
        if first <= row <= last:
            one.parent_frame_id = parent
    return message.SerializeToString()
