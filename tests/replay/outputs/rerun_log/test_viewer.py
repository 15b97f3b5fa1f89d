"""A run opens in a viewer of its own, on this machine only, and the picture shows what it says it shows."""

import socket
import time
from io import BytesIO

import numpy as np
import psutil
import pytest
from rerun.chunk import RrdReader
from support.headless import pixels, viewer_or_skip
from support.small_worlds import cubes

import replay
from replay.errors import RunFolderError
from replay.outputs.rerun_log import viewer as module
from replay.outputs.rerun_log.overview import read_moments
from replay.outputs.rerun_log.viewer import ViewerError, open_viewer, start_viewer


def test_a_folder_without_a_recording_is_one_sentence(tmp_path):
    with pytest.raises(RunFolderError, match=r"holds no run\.rrd; replay a session into it first"):
        open_viewer(tmp_path)


def test_a_miss_that_is_not_there_is_one_sentence_and_starts_nothing(recording):
    count = sum(one.kind == "miss" for one in read_moments(recording))
    with pytest.raises(RunFolderError, match=f"there is no miss 999 in .*; its misses are numbered 1 to {count}"):
        open_viewer(recording.parent, miss=999)


def test_a_missing_binary_is_one_sentence(monkeypatch, tmp_path):
    monkeypatch.setattr(module.rerun_cli, "__path__", [str(tmp_path)])
    with pytest.raises(ViewerError, match="came without its viewer"):
        start_viewer()


def test_a_viewer_that_ends_at_once_says_why(monkeypatch):
    monkeypatch.setattr(module, "LOOPBACK", "not-an-address")
    monkeypatch.setattr(module, "free_port", lambda: 1)
    with pytest.raises(ViewerError, match=r"the viewer ended: .*; a browser shows the same"):
        start_viewer(headless=True)


def test_without_a_screen_the_cure_is_the_picture_in_a_browser():
    words = BytesIO(b"Error: neither WAYLAND_DISPLAY nor DISPLAY is set")
    said = "the viewer ended: there is no screen here; a browser shows the same: `replay share RUN -o DIR`"
    assert module._ended(words).startswith(said)


def test_usage_statistics_are_off_unless_the_user_turned_them_on(monkeypatch, tmp_path):
    monkeypatch.delenv("CI", raising=False)
    assert module.quiet_environment()["CI"]
    monkeypatch.setenv("FORCE_RERUN_ANALYTICS", "1")
    assert "CI" not in module.quiet_environment()


@pytest.mark.slow
def test_a_viewer_writes_no_file_of_statistics(monkeypatch, tmp_path, recording):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.delenv("CI", raising=False)
    with viewer_or_skip(open_viewer, recording.parent, headless=True):
        time.sleep(2.0)
    assert [path for path in tmp_path.rglob("*") if "analytics" in path.name] == []


@pytest.fixture(scope="module")
def opened(recording):
    with viewer_or_skip(open_viewer, recording.parent, headless=True) as opened:
        yield opened


def settled(opened, title):
    """Pixels of the view with this title, once two pictures in a row are equal."""
    before = b""
    for _ in range(50):
        view = next(one for one in opened.state().views if one.name.startswith(title))
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
def test_no_view_reports_an_error_and_one_recording_is_open(opened):
    settled(opened, "Where: red missed,")
    state = opened.state()
    assert len(state.recordings) == 1
    assert not [(view.name, report.summary) for view in state.views for report in view.reports]
    kinds = sorted(view.view_class for view in state.views)
    assert kinds.count("3D") == 4
    assert kinds.count("StateTimeline") == 5
    assert kinds.count("TextLog") == 2
    assert kinds.count("TimeSeries") >= 3


@pytest.mark.slow
def test_the_cursor_stands_on_the_moment_that_leads_and_is_paused(opened, recording):
    place = next(one for one in read_moments(recording) if one.leads)
    time.sleep(0.5)
    shown = opened.state().recordings[0]
    assert (shown.current_timeline, shown.current_time) == ("session", place.session_ns)


@pytest.mark.slow
def test_the_viewer_listens_on_the_loopback_interface_alone(opened):
    listening = [
        one.laddr for one in psutil.Process(opened.process.pid).net_connections() if one.status == psutil.CONN_LISTEN
    ]
    assert opened.port in {address.port for address in listening}
    assert {address.ip for address in listening} <= {"127.0.0.1", "::1"}


LEFT_OUT = {
    "nothing": ([], "Close-up: the moment"), "contacts": (["/world/contacts/**"], "Close-up: the moment"),
    "red faces": (["/world/beaker/missed_faces", "/world/rod/missed_faces"], "Close-up: the moment"),
    "pins and flags": (["/world/focus/pins", "/world/focus/flag", "/world/focus/pole"], "Where: red missed,"),
    "meshes": ([f"/world/{body}/mesh" for body in ("bench", "beaker", "rod", "hand", "headset")], "Where: red missed,"),
    "numbers in lanes": (["/focus/all/2_22\\.5Hz"], "When    red"), "the list": (["/focus/moments"], "Moments"),
    "lanes of the pair": (["/focus/pair/**"], "The pair in focus"), "the answer": (["/answer"], "Answer"),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("what", LEFT_OUT)
def test_the_picture_changes_when_and_only_when_something_is_left_out(opened, demo, recording, tmp_path, what):
    entities, title = LEFT_OUT[what]
    longest = max(demo.misses["22.5Hz"], key=lambda one: one.cut_length)
    place = next(one for one in read_moments(recording) if (one.kind, one.number) == ("miss", longest.number))
    store = RrdReader(recording).recordings()[0]
    pictures = []
    for number, dropped in enumerate(([], entities)):
        # The same application id: the viewer shows both in one layout, so that only the data differ.
        path, stream = tmp_path / f"{number}.rrd", RrdReader(recording).stream()
        (stream.drop(content=dropped) if dropped else stream).write_rrd(
            path, application_id=store.application_id, recording_id=f"{what}-{number}".replace(" ", "-")
        )
        opened.open(path)
        opened.seek(place.session_ns)
        pictures.append(settled(opened, title))
    assert pictures[0].shape == pictures[1].shape
    changed = (np.abs(pictures[0] - pictures[1]).max(axis=2) > 24).mean()
    assert (changed > 2e-4) == bool(entities), f"{changed:.2e} of the pixels"


@pytest.mark.slow
def test_two_runs_are_open_side_by_side_at_one_second_under_their_own_names(tmp_path):
    places = {"a": [0] * 8, "b": [3, 3, 3, 0.9, 3, 3, 3, 3]}
    runs = [
        replay.run(cubes(places), detectors=f"slow=discrete[rate_hz={rate}]", oracle="exact", out=tmp_path / name).out
        for name, rate in (("before", 20), ("after", 100))
    ]
    with viewer_or_skip(open_viewer, *runs, headless=True) as viewer:
        time.sleep(0.5)
        state = viewer.state()
        own = [RrdReader(run / "run.rrd").recordings()[0].recording_id for run in runs]
        assert sorted(one.store_id.rpartition(":")[2] for one in state.recordings) == sorted(own)
        assert str(state.active_recording).endswith(own[0])
        assert [(one.current_timeline, one.current_time) for one in state.recordings] == [("session", 30_000_000)] * 2


@pytest.mark.slow
def test_closing_ends_the_process_and_frees_the_port(opened, recording):
    with open_viewer(recording, miss=1, headless=True) as second:
        port, process = second.port, second.process
        assert port != opened.port
    assert process.poll() is not None
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        probe.bind(("127.0.0.1", port))
