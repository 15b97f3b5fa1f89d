"""The viewer for a browser comes from a server of this machine, within a limit of time; a recording gives moments."""

import socket
import subprocess
import threading
import time
from contextlib import contextmanager
from unittest.mock import Mock

import pytest

from replay.show.rerun_log import viewer, web_viewer
from replay.show.rerun_log.moments import Bookmark
from replay.show.rerun_log.web_viewer import PROGRAM_FILE, SCRIPT_FILE, cursor_at, moment_commands

OK = b"HTTP/1.1 200 OK\r\nContent-Length: 100\r\n\r\n"


@contextmanager
def server(answer):
    """A server that treats each connection by ``answer``; its address."""
    with socket.create_server((viewer.LOOPBACK, 0)) as listening:

        def serve():
            while True:
                try:
                    connection, _ = listening.accept()
                except OSError:
                    return
                threading.Thread(target=answer, args=(connection,), daemon=True).start()

        threading.Thread(target=serve, daemon=True).start()
        try:
            yield f"http://{viewer.LOOPBACK}:{listening.getsockname()[1]}/file"
        finally:
            listening.shutdown(socket.SHUT_RDWR)


def stay_silent(connection):
    """Answer nothing for 10 s."""
    time.sleep(10)
    connection.close()


def send_byte_by_byte(connection):
    """Answer 100 bytes, one each 50 ms."""
    connection.sendall(OK)
    for _ in range(100):
        time.sleep(0.05)
        try:
            connection.sendall(b"x")
        except OSError:
            return


def send_a_piece(connection):
    """Answer 60 of 100 bytes."""
    connection.sendall(OK + b"x" * 60)
    connection.close()


def send_all(connection):
    """Answer 100 bytes."""
    connection.sendall(OK + b"x" * 100)
    connection.close()


def send_no_http(connection):
    """Answer a frame of HTTP/2."""
    connection.sendall(b"\0\0\x06\4\0\0\0\0\0\0\5\0\0\x40\0\r\n\r\n")
    connection.close()


@pytest.mark.parametrize("answer", [stay_silent, send_byte_by_byte, send_a_piece, send_no_http])
def test_incomplete_file_of_a_server_is_abandoned_at_the_deadline(answer):
    """The deadline is 0.3 s; the rest of the 2 s is for a busy machine."""
    with server(answer) as url:
        began = time.monotonic()
        with pytest.raises(viewer.ViewerError, match=r"did not hand out its viewer in \d+ s; try again"):
            web_viewer.fetch_file(url, Mock(poll=lambda: None), time.monotonic() + 0.3)
        assert time.monotonic() - began < 2


def test_reply_of_another_program_on_the_port_is_rejected():
    """A file comes from the port, but the server that was started has ended (``poll`` gives 1, not None)."""
    with server(send_all) as url:
        assert web_viewer.fetch_file(url, Mock(poll=lambda: None), time.monotonic() + 5) == b"x" * 100
        with pytest.raises(web_viewer.ServerEndedError):
            web_viewer.fetch_file(url, Mock(poll=lambda: 1), time.monotonic() + 5)


def test_web_viewer_is_fetched_without_the_configured_proxy(monkeypatch):
    """The proxy never answers; the server sends 100 bytes."""
    with server(stay_silent) as proxy:
        for name in ("http_proxy", "HTTP_PROXY", "all_proxy"):
            monkeypatch.setenv(name, proxy)
        for name in ("no_proxy", "NO_PROXY"):
            monkeypatch.delenv(name, raising=False)
        with server(send_all) as url:
            assert web_viewer.fetch_file(url, Mock(poll=lambda: None), time.monotonic() + 5) == b"x" * 100


@pytest.mark.slow
def test_the_server_starts_again_where_its_port_is_taken(monkeypatch):
    """The first port that Rerun's web server is started with is taken, the second is free.

    It hands out the viewer: a script that exports WebHandle, and a program.
    """
    with socket.create_server((viewer.LOOPBACK, 0)) as taken:
        free = viewer.free_port
        first_ports = iter([taken.getsockname()[1], free()])
        monkeypatch.setattr(viewer, "free_port", lambda: next(first_ports, None) or free())
        files = web_viewer.web_viewer()
    assert b"WebHandle" in files[SCRIPT_FILE]
    web_assembly = b"\0asm"
    assert files[PROGRAM_FILE][:4] == web_assembly


def test_server_that_always_ends_is_one_clear_error(monkeypatch, tmp_path):
    """The program ``false`` is started in its place."""
    ended = Mock(wraps=lambda *_, **__: subprocess.Popen(["false"]))
    monkeypatch.setattr(web_viewer, "start_server", ended)
    with pytest.raises(viewer.ViewerError, match="ended at once, 3 times"):
        web_viewer.served_files(tmp_path)
    assert ended.call_count == web_viewer.MOST_STARTS


def test_only_faults_of_detectors_have_an_address(monkeypatch, tmp_path):
    """The first detector needs no name in an address; an empty one leads to the moment that leads, an event at 7 ns."""
    positions = [
        Bookmark("hull", "miss", number=2, session_ns=5, leads=False),
        Bookmark("mesh", "false", number=1, session_ns=6, leads=False),
        Bookmark("", "event", number=3, session_ns=7, leads=True),
    ]
    monkeypatch.setattr(web_viewer, "read_bookmarks", lambda _: positions)
    commands = moment_commands(tmp_path, ["hull", "mesh"])
    del commands["layout"]
    assert commands == {"miss-2": cursor_at(5), "false-1-mesh": cursor_at(6), "": cursor_at(7)}
    assert moment_commands(tmp_path, []).keys() == {"", "layout"}, "a run that asked no detector"


@pytest.mark.parametrize(
    ("nanoseconds", "digits"),
    [(0, b"\x00"), (127, b"\x7f"), (128, b"\x80\x01"), (300, b"\xac\x02"), (-1, 9 * b"\xff" + b"\x01")],
)
def test_cursor_message_is_protobuf_of_timeline_and_time(nanoseconds, digits):
    """Field 6 holds field 2, whose field 1 is the name of the timeline, and field 3, whose field 1 is a number.

    A field with a length has the tag 8 * number + 2, a number the tag 8 * number; of digits of 7 bits the lowest is
    first, and all but the last have bit 8 set.
    """
    timeline = b"\x0a\x07session"
    time_field = b"\x08" + digits
    content = b"\x12" + bytes([len(timeline)]) + timeline + b"\x1a" + bytes([len(time_field)]) + time_field
    assert cursor_at(nanoseconds) == b"\x32" + bytes([len(content)]) + content
