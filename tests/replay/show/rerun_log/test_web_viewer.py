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
    """The address of a server on this machine that treats each connection by the function ``answer``."""
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


def fetch_within(seconds, url, exit_code=None):
    """The file at an address, fetched within some seconds from a server process; None: that has not ended."""
    server_process = Mock(poll=lambda: exit_code)
    return web_viewer.fetch_file(url, server_process, time.monotonic() + seconds)


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
    """A server that is silent for 10 s, takes 5 s for 100 bytes, sends 60 of these, or speaks HTTP/2.

    The deadline is in 0.3 s: the error comes within 2 s, on a busy machine too.
    """
    with server(answer) as url:
        began = time.monotonic()
        with pytest.raises(viewer.ViewerError, match=r"did not hand out its viewer in \d+ s; try again"):
            fetch_within(0.3, url)
        assert time.monotonic() - began < 2


def test_reply_of_another_program_on_the_port_is_rejected():
    """A whole file comes from the port, but the server that was started has ended with 1: the port is another's."""
    with server(send_all) as url, pytest.raises(web_viewer.ServerEndedError):
        fetch_within(5, url, exit_code=1)


def test_reply_of_the_running_server_is_taken():
    """The server that was started still runs, and sends 100 bytes."""
    with server(send_all) as url:
        assert fetch_within(5, url) == b"x" * 100


def test_web_viewer_is_fetched_without_the_configured_proxy(monkeypatch):
    """The environment names a proxy, which never answers; the server on this machine sends 100 bytes."""
    with server(stay_silent) as proxy, server(send_all) as url:
        for name in ("http_proxy", "HTTP_PROXY", "all_proxy"):
            monkeypatch.setenv(name, proxy)
        for name in ("no_proxy", "NO_PROXY"):
            monkeypatch.delenv(name, raising=False)
        assert fetch_within(5, url) == b"x" * 100


@pytest.mark.slow
def test_the_server_starts_again_where_its_port_is_taken(monkeypatch):
    """The first port that Rerun's web server is started with is taken, the second is free: then the viewer comes.

    It is a script that exports WebHandle, and a program in WebAssembly, which begins with a zero byte and "asm".
    """
    with socket.create_server((viewer.LOOPBACK, 0)) as taken:
        free_port = viewer.free_port
        ports = iter([taken.getsockname()[1], free_port()])
        monkeypatch.setattr(viewer, "free_port", lambda: next(ports, None) or free_port())
        files = web_viewer.web_viewer()
    assert b"WebHandle" in files[SCRIPT_FILE]
    assert files[PROGRAM_FILE].startswith(b"\0asm")


def test_server_that_always_ends_is_a_clear_error(monkeypatch, tmp_path):
    """The program ``false``, which ends at once, is started in place of Rerun's server; there are 3 tries."""
    start_program_that_ends = Mock(wraps=lambda *_, **__: subprocess.Popen(["false"]))
    monkeypatch.setattr(web_viewer, "start_server", start_program_that_ends)
    with pytest.raises(viewer.ViewerError, match="ended at once, 3 times"):
        web_viewer.served_files(tmp_path)
    assert start_program_that_ends.call_count == web_viewer.MOST_STARTS == 3


def test_only_faults_of_detectors_have_an_address(monkeypatch, tmp_path):
    """A recording has three moments as bookmarks: a miss of ``hull``, a false contact of ``mesh``, and an event.

    A page links a fault by kind and number, with its detector unless that is the first. The event has no address, but
    it leads, so the empty address goes there, at 7 ns. "layout" resets the views.
    """
    bookmarks = [
        Bookmark("hull", "miss", number=2, session_ns=5, leads=False),
        Bookmark("mesh", "false", number=1, session_ns=6, leads=False),
        Bookmark("", "event", number=3, session_ns=7, leads=True),
    ]
    monkeypatch.setattr(web_viewer, "read_bookmarks", lambda _: bookmarks)
    commands = moment_commands(tmp_path, ["hull", "mesh"])
    assert commands.pop("layout")
    assert commands == {"miss-2": cursor_at(5), "false-1-mesh": cursor_at(6), "": cursor_at(7)}


def test_run_without_detectors_has_the_leading_moment_alone(monkeypatch, tmp_path):
    """The only moment of a recording, an event of an effect, leads: "" goes there, "layout" resets the views.

    No fault has an address.
    """
    event = Bookmark("", "event", number=3, session_ns=7, leads=True)
    monkeypatch.setattr(web_viewer, "read_bookmarks", lambda _: [event])
    assert moment_commands(tmp_path, []).keys() == {"", "layout"}


def test_cursor_message_is_protobuf_of_timeline_and_time():
    """Field 6 holds field 2, whose field 1 is the name of the timeline, and field 3, whose field 1 is a number.

    In protobuf a field with a length has the tag 8 * number + 2, a number the tag 8 * number; of digits of 7 bits the
    lowest is first, and all but the last have bit 8 set.
    """
    rows = {
        "0": (0, b"\x00"),
        "127, one digit": (127, b"\x7f"),
        "128 = 0 + 1 * 128": (128, b"\x80\x01"),
        "300 = 44 + 2 * 128": (300, b"\xac\x02"),
        "-1, 64 bits of 1": (-1, 9 * b"\xff" + b"\x01"),
    }

    def with_length(number, content):
        return bytes([8 * number + 2, len(content)]) + content

    for row, (nanoseconds, digits) in rows.items():
        time = bytes([8 * 1]) + digits
        cursor = with_length(2, with_length(1, b"session")) + with_length(3, time)
        assert cursor_at(nanoseconds) == with_length(6, cursor), row
