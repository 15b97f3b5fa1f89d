"""Rerun's viewer for a browser, taken from the installed package, and the messages that move its cursor.

Rerun promises neither: the script and the program are what its own web server hands out, and the messages are those of
``viewer_control.proto`` of 0.41, to which rerun-sdk is pinned.
"""

from __future__ import annotations

import subprocess
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Final
from urllib.request import urlopen

from replay.outputs.report.markup import moment_address
from replay.outputs.rerun_log import viewer
from replay.outputs.rerun_log.moments import read_moments
from replay.outputs.rerun_log.recording_file import SESSION

SCRIPT: Final = "re_viewer.js"
PROGRAM: Final = "re_viewer_bg.wasm"
NOTICES: Final = "THIRD_PARTY_NOTICES.md"

NO_WEB_VIEWER: Final = "this rerun-sdk ships no viewer for a browser"

LAYOUT: Final = b"recording.reset_blueprint_to_default"
"""Shows the layout of the recording: a browser draws its first frame, in a layout of its own, before that has come."""


def web_viewer() -> dict[str, bytes]:
    """The viewer's script, its program and the notices of those who wrote it: name of file -> content.

    Raises ``ViewerError``: the installed rerun has none.
    """
    binary, port, other = viewer.viewer_binary(), viewer.free_port(), viewer.free_port()
    words = ["--serve-web", "--bind", viewer.LOOPBACK, "--port", str(other), "--web-viewer-port", str(port)]
    quiet, env = subprocess.DEVNULL, viewer.QUIET
    process = subprocess.Popen([str(binary), *words], stdin=quiet, stdout=quiet, stderr=quiet, env=env)
    try:
        found = {name: _fetched(f"http://{viewer.LOOPBACK}:{port}/{name}", process) for name in (SCRIPT, PROGRAM)}
    finally:
        process.kill()
        process.wait()
    notices = binary.parent / NOTICES
    return found | ({NOTICES: notices.read_bytes()} if notices.is_file() else {})


def _fetched(url: str, process: subprocess.Popen[bytes]) -> bytes:
    deadline = time.monotonic() + viewer.START_SECONDS
    while True:
        try:
            with urlopen(url, timeout=viewer.START_SECONDS) as answer:
                content: bytes = answer.read()
                return content
        except OSError as error:
            # A server that answers has started: what it does not hand out now it never will.
            if process.poll() is not None or hasattr(error, "code") or time.monotonic() > deadline:
                raise viewer.ViewerError(f"{NO_WEB_VIEWER} ({error})") from error
            time.sleep(viewer.PAUSE_SECONDS)


def moment_commands(recording: Path, labels: Sequence[str]) -> dict[str, bytes]:
    """Address of a moment -> the message that puts the cursor there; ``""``: the worst moment, ``"layout"``: see there.

    ``labels`` are the audited detectors in their order; an address without one means the first.
    """
    at: dict[str, int] = {}
    for one in read_moments(recording):
        if one.number:
            at[moment_address(one.kind, one.number, "" if one.label == labels[0] else one.label)] = one.session_ns
        if one.leads:
            at[""] = one.session_ns
    return {name: cursor_at(ns) for name, ns in at.items()} | {"layout": _field(11, _field(1, LAYOUT))}


def cursor_at(session_ns: int) -> bytes:
    """The message that puts the cursor at a time of the session and pauses there."""
    timeline, moment = _field(1, SESSION.encode()), _varint(1 << 3) + _varint(session_ns)
    return _field(6, _field(2, timeline) + _field(3, moment))


def _field(number: int, content: bytes) -> bytes:
    """A field of a protobuf message that has a length."""
    return _varint(number << 3 | 2) + _varint(len(content)) + content


def _varint(value: int) -> bytes:
    # Negative numbers have 64 bits, ten bytes.
    value %= 1 << 64
    digits = []
    while value > 127:
        digits.append(value & 127 | 128)
        value >>= 7
    return bytes([*digits, value])
