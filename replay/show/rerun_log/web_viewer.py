"""Rerun's viewer for a browser, taken from the installed package, and the messages that move its cursor.

Rerun promises neither: the script and the program are what its own web server hands out, and the messages are those of
``viewer_control.proto`` of 0.41, to which rerun-sdk is pinned.
"""

from __future__ import annotations

import subprocess
import time
from collections.abc import Sequence
from http.client import HTTPException, HTTPResponse
from pathlib import Path
from typing import Final
from urllib.error import HTTPError
from urllib.request import ProxyHandler, build_opener

from replay import words
from replay.show.report.markup import moment_address
from replay.show.rerun_log import viewer
from replay.show.rerun_log.moments import read_bookmarks
from replay.show.rerun_log.recording_file import SESSION_TIMELINE

SCRIPT_FILE: Final = "re_viewer.js"
PROGRAM_FILE: Final = "re_viewer_bg.wasm"
NOTICES_FILE: Final = "THIRD_PARTY_NOTICES.md"

NO_WEB_VIEWER: Final = "this rerun-sdk ships no viewer for a browser"

SERVE_SECONDS: Final = 120.0
"""From the start of the server to the last byte of the viewer's program: 30 s with ten programs for each processor."""

SILENT_SECONDS: Final = 5.0
"""A server that sends nothing for so long is asked again; on a port of another program nobody may ever answer."""

TOO_LATE_MESSAGE: Final = (
    f"Rerun's web server did not hand out its viewer in {words.decimal(SERVE_SECONDS, 0)} s; try again"
)

MOST_STARTS: Final = 3
READ_BYTES: Final = 1 << 20

DIRECT_OPENER: Final = build_opener(ProxyHandler({}))
"""Opens addresses of this machine: a proxy that the environment names cannot reach them."""

LAYOUT_CALL: Final = b"recording.reset_blueprint_to_default"
"""Shows the layout of the recording: a browser draws its first frame, in a layout of its own, before that has come."""


def web_viewer() -> dict[str, bytes]:
    """The viewer's script, its program and the notices of those who wrote it: name of file -> content.

    Raises ``ViewerError``: the installed rerun has none.
    """
    binary = viewer.viewer_binary()
    notices = binary.parent / NOTICES_FILE
    files = served_files(binary)
    return files | ({NOTICES_FILE: notices.read_bytes()} if notices.is_file() else {})


def served_files(binary: Path) -> dict[str, bytes]:
    """Return what Rerun's web server hands out; it is started again on other ports while its own are taken."""
    deadline = time.monotonic() + SERVE_SECONDS
    for _ in range(MOST_STARTS):
        web_port, log_port = viewer.free_port(), viewer.free_port()
        process = start_server(binary, web_port=web_port, log_port=log_port)
        try:
            address = f"http://{viewer.LOOPBACK}:{web_port}"
            return {name: fetch_file(f"{address}/{name}", process, deadline) for name in (SCRIPT_FILE, PROGRAM_FILE)}
        except ServerEndedError:
            continue
        finally:
            process.kill()
            process.wait()
    raise viewer.ViewerError(f"Rerun's web server ended at once, {MOST_STARTS} times; try again")


def start_server(binary: Path, *, web_port: int, log_port: int) -> subprocess.Popen[bytes]:
    """Start Rerun's web server on the loopback interface."""
    ports = ["--port", str(log_port), "--web-viewer-port", str(web_port)]
    devnull = subprocess.DEVNULL
    return subprocess.Popen(
        [str(binary), "--serve-web", "--bind", viewer.LOOPBACK, *ports],
        stdin=devnull,
        stdout=devnull,
        stderr=devnull,
        env=viewer.QUIET_ENVIRONMENT,
    )


class ServerEndedError(Exception):
    """Rerun's server ended before it handed out a file: another program has its port."""


def fetch_file(url: str, process: subprocess.Popen[bytes], deadline: float) -> bytes:
    """Return a file of Rerun's web server, whose process may still be starting.

    Raises ``ServerEndedError``, and ``ViewerError``: there is no such file, or not all of it before the deadline.
    """
    while True:
        try:
            seconds_left = max(viewer.PAUSE_SECONDS, deadline - time.monotonic())
            with DIRECT_OPENER.open(url, timeout=min(SILENT_SECONDS, seconds_left)) as answer:
                content = _read_until(answer, deadline)
        except (OSError, HTTPException) as error:
            if process.poll() is not None:
                raise ServerEndedError from error
            # A server that answers has started: what it does not hand out now it never will.
            if isinstance(error, HTTPError):
                raise viewer.ViewerError(NO_WEB_VIEWER) from error
            if time.monotonic() > deadline:
                raise viewer.ViewerError(TOO_LATE_MESSAGE) from error
            time.sleep(viewer.PAUSE_SECONDS)
        else:
            # A server that has ended left its port to another program, which answered in its place.
            if process.poll() is not None:
                raise ServerEndedError
            return content


def _read_until(answer: HTTPResponse, deadline: float) -> bytes:
    """Return the content of an answer; ``OSError``: it is cut short, or not all there at the deadline."""
    chunks = []
    while chunk := answer.read1(READ_BYTES):
        chunks.append(chunk)
        if time.monotonic() > deadline:
            raise TimeoutError("the server sends too slowly")
    if answer.length:
        raise OSError(f"the last {answer.length} bytes did not come")
    return b"".join(chunks)


def moment_commands(recording: Path, labels: Sequence[str]) -> dict[str, bytes]:
    """Address of a moment -> the message that puts the cursor there; ``""``: the worst moment, ``"layout"``: see there.

    ``labels`` are the audited detectors in their order; an address without one means the first.
    """
    ns_by_address: dict[str, int] = {}
    for moment in read_bookmarks(recording):
        # Contacts and events are no fault of a detector, and no page has a link to them.
        if moment.label in labels:
            label = "" if moment.label == labels[0] else moment.label
            ns_by_address[moment_address(moment.kind, moment.number, label)] = moment.session_ns
        if moment.leads:
            ns_by_address[""] = moment.session_ns
    return {name: cursor_at(ns) for name, ns in ns_by_address.items()} | {"layout": _field(11, _field(1, LAYOUT_CALL))}


def cursor_at(session_ns: int) -> bytes:
    """The message that puts the cursor at a time of the session and pauses there."""
    timeline, moment = _field(1, SESSION_TIMELINE.encode()), _varint(1 << 3) + _varint(session_ns)
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
