"""Frames to message records without a message object for each: the bytes decode to the same numbers, bit for bit."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from sessions.errors import SessionFileError
from sessions.mcap.container import MessageRecord
from sessions.mcap.frame_layout import NEGATIVE_WIDTH, SECONDS_WIDTH, frame_layout
from sessions.mcap.schemas import message_class
from sessions.model.frames import Frames, Status

SECOND_NS = 1_000_000_000
# A frame in which no body has a sample is this message on /tracking and none on /tf: the MCAP importer of Rerun 0.41
# aborts the whole process on a FrameTransforms without transforms (index out of bounds, 2026-11).
FRAME_WITHOUT_SAMPLES = b"\x10\x01"


def check_stamp(what: str, time_ns: int) -> None:
    """Refuse a stamp before 0, which an MCAP file cannot hold."""
    if time_ns < 0:
        raise SessionFileError(
            f"{what} stamped {time_ns} ns, and a session file starts at 0; shift all stamps of the session so that "
            "none is negative"
        )


class FrameEncoder:
    """Turns frames into records of ``/tf`` and ``/tracking``.

    A frame whose present samples are all valid is one ``/tf`` message. Any other has a ``/tracking`` message with the
    same sequence and stamps just before it, which names the bodies that are not valid; so each frame can be judged
    without what came before, and a file cut between the two never turns a lost sample into a valid one. A frame without
    any sample is a ``/tracking`` message alone.
    """

    def __init__(self, tf_channel: int, tracking_channel: int) -> None:
        self._tf, self._tracking = tf_channel, tracking_channel
        self._payloads: dict[tuple[tuple[str, ...], bytes], bytes] = {}
        self._sequence = 0

    def encode(self, frames: Frames) -> Iterator[MessageRecord]:
        """The messages of each frame, numbered on from the last call; a stamp before 0 is an error."""
        if not len(frames):
            return
        check_stamp("a frame is", int(min(frames.stamp_ns.min(), frames.log_ns.min())))
        sequence = np.arange(self._sequence, self._sequence + len(frames)) % (1 << 32)
        self._sequence += len(frames)
        channel = np.where((frames.status == Status.ABSENT).all(axis=1), self._tracking, self._tf)
        columns = (channel.tolist(), sequence.tolist(), frames.log_ns.tolist(), frames.stamp_ns.tolist())
        for note, *record in zip(self._tracking_payloads(frames), *columns, _payloads(frames), strict=True):
            if note:
                yield self._tracking, *record[1:4], note
            yield tuple(record)

    def _tracking_payloads(self, frames: Frames) -> list[bytes]:
        """For each frame the ``/tracking`` payload, or nothing when all its samples are valid."""
        notes = [b""] * len(frames)
        odd = (frames.status != Status.VALID) & (frames.status != Status.ABSENT)
        for row in np.flatnonzero(odd.any(axis=1)).tolist():
            key = (frames.names, frames.status[row].tobytes())
            if key not in self._payloads:
                message = message_class("Tracking")()
                for column in np.flatnonzero(odd[row]).tolist():
                    message.bodies.add(name=frames.names[column], status=int(frames.status[row, column]))
                self._payloads[key] = bytes(message.SerializeToString(deterministic=True))
            notes[row] = self._payloads[key]
        return notes


def _payloads(frames: Frames) -> list[bytes]:
    """The message of each frame; those of frames with the same bodies are the rows of a table."""
    present = frames.status != Status.ABSENT
    negative = ((frames.sample_ns < 0) & present).any(axis=1)
    key = np.packbits(np.column_stack([present, negative]), axis=1)
    if (key == key[0]).all():
        groups = [np.arange(len(frames))]
    else:
        kinds = np.unique(key, axis=0, return_inverse=True)[1].reshape(-1)
        order = np.argsort(kinds, kind="stable")
        groups = np.split(order, np.flatnonzero(np.diff(kinds[order])) + 1)
    seconds, nanos = np.divmod(frames.sample_ns, SECOND_NS)
    encodings = [FRAME_WITHOUT_SAMPLES] * len(frames)
    for rows in groups:
        bodies = np.flatnonzero(present[rows[0]])
        if len(bodies):
            names = tuple(frames.names[body] for body in bodies)
            layout = frame_layout(names, NEGATIVE_WIDTH if negative[rows[0]] else SECONDS_WIDTH)
            cells: Any = ... if len(rows) * len(bodies) == present.size else np.ix_(rows, bodies)
            poses = frames.position[cells], frames.quaternion_xyzw[cells]
            table = layout.table(seconds[cells], nanos[cells], *poses)
            for row, payload in zip(rows.tolist(), table, strict=True):
                encodings[row] = payload.tobytes()
    return encodings
