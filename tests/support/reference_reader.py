"""The plain way to read frames: one message after the other, every one through the protobuf library.

It exists to be slow and right: the chunk-level reader must give the same bits and be at least three times as fast. It
shares nothing with it but the model: the container is read by the `mcap` library.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from mcap.reader import NonSeekingReader

from sessions.mcap_format.schemas import TF, TRACKING, message_class
from sessions.model.frames import Frames, Status


@dataclass
class _Frame:
    stamp_ns: int
    log_ns: int
    message: Any
    note: Any


def read_frames_plainly(path: str | Path, names: tuple[str, ...] = ()) -> Frames:
    """All frames of a file in file order; columns in the order given, then in that of first appearance."""
    recorded = list(_recorded(Path(path)))
    columns = {name: column for column, name in enumerate(names)}
    for frame in recorded:
        for one in frame.message.transforms:
            columns.setdefault(one.child_frame_id, len(columns))
    shape = (len(recorded), len(columns))
    stamps, logs = (np.zeros(len(recorded), dtype=np.int64) for _ in range(2))
    sample = np.zeros(shape, dtype=np.int64)
    position, quaternion = np.full((*shape, 3), np.nan), np.full((*shape, 4), np.nan)
    status = np.zeros(shape, dtype=np.uint8)
    for row, frame in enumerate(recorded):
        stamps[row], logs[row] = frame.stamp_ns, frame.log_ns
        for one in frame.message.transforms:
            cell = row, columns[one.child_frame_id]
            stamp, p, q = one.timestamp, one.translation, one.rotation
            sample[cell] = stamp.seconds * 10**9 + stamp.nanos if one.HasField("timestamp") else frame.stamp_ns
            position[cell] = p.x, p.y, p.z
            quaternion[cell] = q.x, q.y, q.z, q.w
            status[cell] = Status.VALID
        for body in frame.note.bodies if frame.note is not None else ():
            status[row, columns[body.name]] = body.status
    return Frames(tuple(columns), stamps, logs, sample, position, quaternion, status)


def _recorded(path: Path) -> Iterator[_Frame]:
    """Frames with the validity note that stands before them, if the two have the same stamps."""
    tracking, pending = message_class("Tracking"), None
    with path.open("rb") as stream:
        for _, channel, message in NonSeekingReader(stream).iter_messages(log_time_order=False):
            identity = (message.sequence, message.publish_time, message.log_time)
            if channel.topic == TRACKING:
                pending = (identity, tracking.FromString(message.data))
                if pending[1].frame_without_samples:
                    yield _Frame(message.publish_time, message.log_time, FrameTransforms(), None)
                    pending = None
            elif channel.topic == TF:
                note = pending[1] if pending is not None and pending[0] == identity else None
                yield _Frame(message.publish_time, message.log_time, FrameTransforms.FromString(message.data), note)
                pending = None
