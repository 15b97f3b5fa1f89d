"""A run opens in a viewer of its own, on this machine only, and the picture shows what it says it shows."""

import io
import socket
import time
from types import SimpleNamespace
from unittest.mock import Mock

import psutil
import pytest
from support.viewers import pixels, viewer_or_skip

from replay.errors import RunFolderError
from replay.show.rerun_log import viewer as module
from replay.show.rerun_log.moments import Bookmark, read_bookmarks
from replay.show.rerun_log.viewer import OpenViewer, ViewerError, open_viewer, start_viewer, target_ns


def test_missing_viewer_is_a_clear_error(monkeypatch, tmp_path):
    """The program of Rerun's package is looked for in an empty folder."""
    monkeypatch.setattr(module.rerun_cli, "__path__", [str(tmp_path)])
    with pytest.raises(ViewerError, match="came without its viewer"):
        start_viewer()


def test_viewer_that_fails_to_start_is_reported_with_output(monkeypatch):
    """The viewer is to listen at the address "not-an-address": it ends, and the error quotes what it printed."""
    monkeypatch.setattr(module, "LOOPBACK", "not-an-address")
    monkeypatch.setattr(module, "free_port", lambda: 1)
    with pytest.raises(ViewerError, match=r"the viewer ended: .*; a browser shows the same"):
        start_viewer(headless=True)


def test_opening_waits_until_the_viewer_has_loaded_everything(tmp_path):
    """A stand-in for a viewer, whose state is asked for again and again: (its recordings, whether it still loads).

    Only in the fifth state it has the one recording, which has the time line of a session, and loads no more.
    """
    empty, whole = SimpleNamespace(timelines=[]), SimpleNamespace(timelines=["session"])
    still_loading = [([], False), ([empty], False), ([whole, empty], False), ([whole], True)]
    states = [
        SimpleNamespace(recordings=recordings, loading=loading)
        for recordings, loading in [*still_loading, ([whole], False)]
    ]
    client = Mock(get_state=Mock(side_effect=states))
    OpenViewer(Mock(), 0, client, io.BytesIO()).open(tmp_path / "run.rrd")
    assert client.get_state.call_count == len(states)


def test_the_cursor_goes_to_the_moment_that_leads(monkeypatch, tmp_path):
    """A recording has two moments as bookmarks, of which the second leads, at 7 ns; no fault is requested."""
    bookmarks = [
        Bookmark("hull", "miss", number=1, session_ns=5, leads=False),
        Bookmark("mesh", "miss", number=1, session_ns=7, leads=True),
    ]
    monkeypatch.setattr(module, "read_bookmarks", lambda _: bookmarks)
    monkeypatch.setattr(module, "start_viewer", Mock())
    open_viewer(tmp_path).seek.assert_called_once_with(7)


@pytest.fixture
def four_bookmarks(monkeypatch):
    """Four faults of a recording as bookmarks: two of ``hull``, two of ``mesh``; miss 1 of ``mesh`` leads."""
    bookmarks = [
        Bookmark("hull", "miss", number=1, session_ns=5, leads=False),
        Bookmark("hull", "false", number=1, session_ns=6, leads=False),
        Bookmark("mesh", "miss", number=1, session_ns=7, leads=True),
        Bookmark("mesh", "miss", number=2, session_ns=8, leads=False),
    ]
    monkeypatch.setattr(module, "read_bookmarks", lambda _: bookmarks)


def test_cursor_goes_to_the_requested_fault(tmp_path, four_bookmarks):
    """``hull`` has miss 1 at 5 ns, false contact 1 at 6; ``mesh`` miss 1 at 7 ns, which leads, and miss 2 at 8."""
    rows = {
        "nothing: the leading moment": (None, None, "", 7),
        "hull, which does not lead: the begin": (None, None, "hull", 0),
        "mesh, which leads": (None, None, "mesh", 7),
        "miss 1, of hull, the first that has it": (1, None, "", 5),
        "miss 1 of mesh": (1, None, "mesh", 7),
        "miss 2, of mesh alone": (2, None, "", 8),
        "false contact 1": (None, 1, "", 6),
    }
    for row, (miss, false, detector, nanoseconds) in rows.items():
        assert target_ns(tmp_path, miss=miss, false=false, by=detector) == nanoseconds, row


@pytest.mark.parametrize(
    ("miss", "detector"), [pytest.param(3, "", id="miss 3"), pytest.param(2, "hull", id="miss 2 of hull")]
)
def test_requested_fault_that_no_detector_has_is_refused(tmp_path, four_bookmarks, miss, detector):
    """``hull`` has miss 1, ``mesh`` misses 1 and 2."""
    with pytest.raises(RunFolderError, match="there is no miss"):
        target_ns(tmp_path, miss=miss, false=None, by=detector)


@pytest.fixture(scope="module")
def open_rerun(recording):
    """Rerun's viewer without a window, which shows the recording of the run of taps."""
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
    """Rerun's viewer without a window has one recording open; of each view it reports what it could not draw: nothing.

    Views of five kinds are open, once the one with the rooms and dots of faults is drawn.
    """
    settled(open_rerun, title="Where   a dot: a fault, in the colours of When")
    state = open_rerun.state()
    assert len(state.recordings) == 1
    assert {view.view_class for view in state.views} >= {"3D", "2D", "StateTimeline", "TextLog", "TimeSeries"}
    assert [(view.name, report.summary) for view in state.views for report in view.reports] == []


@pytest.mark.slow
def test_viewer_opens_paused_at_the_moment_of_the_headline(open_rerun, recording):
    """The bookmark that leads is the moment of the headline; half a second after opening the cursor is still there."""
    (headline,) = [bookmark for bookmark in read_bookmarks(recording) if bookmark.leads]
    time.sleep(0.5)
    (opened_recording,) = open_rerun.state().recordings
    assert opened_recording.current_timeline == "session"
    assert opened_recording.current_time == headline.session_ns


@pytest.mark.slow
def test_the_viewer_listens_on_the_loopback_interface_alone(open_rerun):
    """No other machine reaches it: all ports that its process listens on are of 127.0.0.1 or ::1."""
    connections = psutil.Process(open_rerun.process.pid).net_connections()
    listening = [item.laddr for item in connections if item.status == psutil.CONN_LISTEN]
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
