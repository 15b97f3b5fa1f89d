"""The file of a recording: encoded by Rerun, written by us, complete under its name or an error.

Rerun's own file sink only logs that a disk is full: the process exits 0 with half a picture, or never ends (in
``save``, in ``disconnect`` or at exit; 7 of 10 with ``ulimit -f``). So Rerun encodes into memory; the file is ours.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final
from uuid import uuid4

import rerun as rr
import rerun.blueprint as rrb

from replay.errors import OutputError
from sessions.whole_files import whole_file

FOOTER: Final = struct.Struct("<QQI4s4sI")
"""How a recording ends: start and length of its table of contents, checksum, two marks, number of tables."""

ENCODED_WITHIN_S: Final = 600.0
"""Seconds after which Rerun is taken to hang: ten minutes of twelve bodies are encoded in less than one."""


@contextmanager
def recording_file(application: str, path: Path, blueprint: rrb.Blueprint) -> Iterator[rr.RecordingStream]:
    """A stream whose messages are in the file ``path`` when the block has ended.

    Raises ``OSError``: the file cannot be written, or what Rerun made is no complete recording.
    """
    stream = rr.RecordingStream(application, recording_id=uuid4())
    try:
        encoded = rr.binary_stream(recording=stream)
        stream.send_blueprint(blueprint, make_active=False, make_default=True)
        yield stream
        content = read_all(encoded)
    finally:
        stream.disconnect()
    require_complete(content)
    with whole_file(path, OutputError) as file:
        file.write(content)


def require_complete(content: bytes) -> None:
    """Raise ``OSError`` unless these are the bytes of one whole recording, from its first to its footer."""
    if len(content) >= FOOTER.size:
        start, length, _, *marks, tables = FOOTER.unpack(content[-FOOTER.size :])
        if marks == [b"RRF2", b"FOOT"] and tables == 1 and start + length + FOOTER.size == len(content):
            return
    raise OSError(f"the picture has no end after {len(content)} bytes: Rerun did not encode all of it")


def read_all(encoded: rr.BinaryStream) -> bytes:
    """What Rerun has encoded; ``OSError`` where that takes too long."""
    try:
        return encoded.read(flush=True, flush_timeout_sec=ENCODED_WITHIN_S) or b""
    except (RuntimeError, ValueError) as error:
        raise OSError(f"Rerun did not encode the picture within {ENCODED_WITHIN_S:g} s ({error})") from error


def name_layer(application: str, recording: str, name: str) -> bytes:
    """What a viewer opens over a recording, given by its ids, to list it under another name."""
    stream = rr.RecordingStream(application, recording_id=recording)
    try:
        encoded = rr.binary_stream(recording=stream)
        stream.send_recording_name(name)
        return read_all(encoded)
    finally:
        stream.disconnect()
