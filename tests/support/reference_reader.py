"""The plain way to read frames: one message after the other, every one through the protobuf library.

It exists to be slow and right: the chunk-level reader must give the same bits. It shares nothing with it but the model:
the container is read by the `mcap` library.
"""

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from mcap.reader import NonSeekingReader

from sessions.mcap.schemas import TF, TRACKING, message_class
from sessions.model.frames import Frames, Status


def read_frames_plainly(path, names=()):
    """All frames of a file in file order; columns in the order given, then in that of first appearance."""
    recorded = list(recorded_frames(path))
    columns = {name: column for column, name in enumerate(names)}
    for _, message, _ in recorded:
        for pose in message.transforms:
            columns.setdefault(pose.child_frame_id, len(columns))
    shape = (len(recorded), len(columns))
    stamps = np.array([stamp for stamp, *_ in recorded], dtype=np.int64).reshape(-1, 2)
    sample, status = np.zeros(shape, dtype=np.int64), np.zeros(shape, dtype=np.uint8)
    position, quaternion = np.full((*shape, 3), np.nan), np.full((*shape, 4), np.nan)
    for row, ((published, _), message, note) in enumerate(recorded):
        for pose in message.transforms:
            cell = row, columns[pose.child_frame_id]
            stamp, p, q = pose.timestamp, pose.translation, pose.rotation
            sample[cell] = stamp.seconds * 10**9 + stamp.nanos if pose.HasField("timestamp") else published
            position[cell], quaternion[cell], status[cell] = (p.x, p.y, p.z), (q.x, q.y, q.z, q.w), Status.VALID
        for body in note.bodies:
            status[row, columns[body.name]] = body.status
    return Frames(tuple(columns), *stamps.T, sample, position, quaternion, status)


def recorded_frames(path):
    """Stamps of each frame, its poses, and the validity note that stands before it, if the two have the same stamps."""
    tracking = message_class("Tracking")
    nothing = pending = (None, tracking())
    with path.open("rb") as stream:
        for _, channel, message in NonSeekingReader(stream).iter_messages(log_time_order=False):
            identity = (message.sequence, message.publish_time, message.log_time)
            if channel.topic == TRACKING:
                pending = (identity, tracking.FromString(message.data))
                if pending[1].frame_without_samples:
                    yield identity[1:], FrameTransforms(), nothing[1]
                    pending = nothing
            elif channel.topic == TF:
                yield (
                    identity[1:],
                    FrameTransforms.FromString(message.data),
                    (pending if pending[0] == identity else nothing)[1],
                )
                pending = nothing
