"""A run opens in a viewer of its own, on this machine only, and the picture shows what it says it shows."""

import io
import socket
import time
from contextlib import nullcontext
from types import SimpleNamespace
from unittest.mock import Mock

import psutil
import pytest
from support.viewers import pixels, viewer_or_skip

from replay.errors import RunFolderError
from replay.show.rerun_log import viewer as module
from replay.show.rerun_log.moments import Bookmark, read_bookmarks
from replay.show.rerun_log.viewer import OpenViewer, ViewerError, open_viewer, start_viewer, target_ns


def test_missing_viewer_is_one_clear_error(monkeypatch, tmp_path):
    """Rerun's package is looked for in an empty folder."""
    monkeypatch.setattr(module.rerun_cli, "__path__", [str(tmp_path)])
    with pytest.raises(ViewerError, match="came without its viewer"):
        start_viewer()


def test_viewer_that_fails_to_start_is_reported_with_output(monkeypatch):
    """It is to listen on an address that is none."""
    monkeypatch.setattr(module, "LOOPBACK", "not-an-address")
    monkeypatch.setattr(module, "free_port", lambda: 1)
    with pytest.raises(ViewerError, match=r"the viewer ended: .*; a browser shows the same"):
        start_viewer(headless=True)


def test_opening_waits_until_the_viewer_has_loaded_everything(tmp_path):
    """Nothing, an empty recording, a second one, still loading; the fifth state is that of a viewer that is done."""
    empty, whole = SimpleNamespace(timelines=[]), SimpleNamespace(timelines=["session"])
    arriving = [([], False), ([empty], False), ([whole, empty], False), ([whole], True), ([whole], False)]
    states = [SimpleNamespace(recordings=recordings, loading=loading) for recordings, loading in arriving]
    client = Mock(get_state=Mock(side_effect=states))
    OpenViewer(Mock(), 0, client, io.BytesIO()).open(tmp_path / "run.rrd")
    assert client.get_state.call_count == len(states)


def test_the_cursor_goes_to_the_moment_that_leads(monkeypatch, tmp_path):
    """The second of two bookmarks leads, at 7 ns."""
    bookmarks = [
        Bookmark("hull", "miss", number=1, session_ns=5, leads=False),
        Bookmark("mesh", "miss", number=1, session_ns=7, leads=True),
    ]
    monkeypatch.setattr(module, "read_bookmarks", lambda _: bookmarks)
    monkeypatch.setattr(module, "start_viewer", Mock())
    open_viewer(tmp_path).seek.assert_called_once_with(7)


@pytest.mark.parametrize(
    ("requested", "nanoseconds"),
    [
        ({}, 7),
        ({"by": "hull"}, 0),
        ({"by": "mesh"}, 7),
        ({"miss": 1}, 5),
        ({"miss": 1, "by": "mesh"}, 7),
        ({"miss": 2}, 8),
        ({"false": 1}, 6),
        ({"miss": 3}, None),
        ({"miss": 2, "by": "hull"}, None),
    ],
)
def test_cursor_goes_to_the_requested_fault(monkeypatch, tmp_path, requested, nanoseconds):
    """Without a number to the moment that leads, of that detector; a number to the first detector that has it."""
    bookmarks = [
        Bookmark("hull", "miss", 1, 5, leads=False), Bookmark("hull", "false", 1, 6, leads=False),
        Bookmark("mesh", "miss", 1, 7, leads=True), Bookmark("mesh", "miss", 2, 8, leads=False),
    ]  # fmt: skip
    monkeypatch.setattr(module, "read_bookmarks", lambda _: bookmarks)
    arguments = {"miss": None, "false": None, "by": ""} | requested
    with nullcontext() if nanoseconds is not None else pytest.raises(RunFolderError, match="there is no miss"):
        assert target_ns(tmp_path, **arguments) == nanoseconds


@pytest.fixture(scope="module")
def open_rerun(recording):
    """A viewer without a window that shows a recording."""
    with viewer_or_skip(open_viewer, recording, headless=True) as opened:
        yield opened


def settled(opened, title):
    """Pixels of the view with this title, once two pictures in a row are equal."""
    before = b""
    for _ in range(50):
        view = next(item for item in opened.state().views if item.name.startswith(title))
        try:
            picture = opened.screenshot(view)
        except ConnectionError:  # Not laid out yet.
            picture = b""
        if picture and picture == before:
            break
        before = picture
        time.sleep(0.2)
    return pixels(before)


@pytest.mark.slow
def test_no_view_reports_an_error_and_a_recording_is_open(open_rerun):
    """A real viewer without a window says of each view what it could not draw."""
    settled(open_rerun, "Where   a dot: a fault, in the colours of When")
    state = open_rerun.state()
    assert len(state.recordings) == 1
    assert not [(view.name, report.summary) for view in state.views for report in view.reports]
    assert {view.view_class for view in state.views} >= {"3D", "2D", "StateTimeline", "TextLog", "TimeSeries"}


@pytest.mark.slow
def test_viewer_opens_paused_at_the_moment_of_the_headline(open_rerun, recording):
    """Half a second later the cursor is still there."""
    bookmark = next(item for item in read_bookmarks(recording) if item.leads)
    time.sleep(0.5)
    printed = open_rerun.state().recordings[0]
    assert (printed.current_timeline, printed.current_time) == ("session", bookmark.session_ns)


@pytest.mark.slow
def test_the_viewer_listens_on_the_loopback_interface_alone(open_rerun):
    """All ports that its process listens on are of 127.0.0.1 or ::1."""
    listening = [
        item.laddr
        for item in psutil.Process(open_rerun.process.pid).net_connections()
        if item.status == psutil.CONN_LISTEN
    ]
    assert open_rerun.port in {address.port for address in listening}
    assert {address.ip for address in listening} <= {"127.0.0.1", "::1"}


@pytest.mark.slow
def test_closing_ends_the_process_and_frees_the_port(open_rerun, recording):
    """A second viewer, on a port of its own, is closed by leaving its context; then the port can be bound."""
    with open_viewer(recording, miss=1, headless=True) as second:
        port, process = second.port, second.process
        assert port != open_rerun.port
    assert process.poll() is not None
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        probe.bind(("127.0.0.1", port))
