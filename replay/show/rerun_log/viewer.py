"""Opens a run in its own viewer on the loopback interface, with the cursor where there is most to see.

The one module that knows Rerun's experimental viewer client, which is why rerun-sdk is pinned to one minor version. The
viewer's binary is started directly and not through the ``rerun`` command: that is a Python wrapper, and ending the
wrapper leaves the viewer alive on its port, where the next run would talk to the old one.
"""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import tempfile
import time
from contextlib import AbstractContextManager, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import IO, Any, Final

import numpy as np
import rerun as rr
import rerun_cli
from rerun.chunk import RrdReader
from rerun.experimental import View, ViewerClient, ViewerState

from replay import words
from replay.errors import OutputError, ReplayError, RunFolderError
from replay.show.rerun_log.moments import read_bookmarks
from replay.show.rerun_log.recording_file import SESSION_TIMELINE, name_layer
from sessions.temporary_folders import temporary_folder

LOOPBACK: Final = "127.0.0.1"
"""A recording shows people at work: it is never served to the network."""

START_SECONDS: Final = 40.0
"""A cold start of the 290 MB binary from a slow disk stays below half of this."""

QUIET_ENVIRONMENT: Final = {**os.environ, "CI": "1"}
"""Variables for Rerun's program: on a build server it sends no usage statistics. Its own file of settings says that it
may from its first start, whoever started it; there is no other switch that leaves the user's files alone."""

LOAD_SECONDS: Final = 60.0
PAUSE_SECONDS: Final = 0.05

SERVE: Final = "serve-local"
"""Where a notebook has the viewer's files from: the installed package and not app.rerun.io, so it works offline."""

NO_ADAPTER: Final = "there is no graphics driver here"

_KNOWN_ENDS: Final = {
    "neither WAYLAND_DISPLAY": "there is no screen here",
    "No graphics adapter": NO_ADAPTER,
    "Failed to get render context": NO_ADAPTER,
}
"""What the viewer prints when it ends at once, and what that means."""


class ViewerError(ReplayError, RuntimeError):
    """The viewer cannot be started, or does not open the recording."""


class OpenViewer(AbstractContextManager["OpenViewer"]):
    """A viewer process (ended by this handle and no other) and the line to it, on a port of the loopback interface.

    It ends with ``close``, or by itself when its window is closed.
    """

    def __init__(self, process: subprocess.Popen[bytes], port: int, client: ViewerClient, log: IO[bytes]) -> None:
        self.process = process
        self.port = port
        self._client = client
        self._log = log

    def __exit__(self, *problem: object) -> None:
        self.close()

    def open(self, recording: Path) -> None:
        """Load a recording and wait until all of it is there; ``ViewerError``: not in a minute, or the viewer ended."""
        try:
            self._client.open(str(recording.resolve()))
            deadline = time.monotonic() + LOAD_SECONDS
            while not _all_present(self.state()):
                if time.monotonic() > deadline:
                    late_sentence = f"the viewer did not load {recording} in {words.decimal(LOAD_SECONDS, 0)} s"
                    raise ViewerError(f"{late_sentence}; try `rerun {recording}`")
                time.sleep(PAUSE_SECONDS)
        except ConnectionError as error:
            raise ViewerError(_end_sentence(self._log)) from error

    def rename(self, recording: Path, name: str) -> None:
        """Show a recording that is open under another name in the list of recordings."""
        (recording_store,) = RrdReader(recording).recordings()
        with temporary_folder() as folder:
            name_layer_file = folder / "name.rrd"
            name_layer_file.write_bytes(name_layer(recording_store.application_id, recording_store.recording_id, name))
            self.open(name_layer_file)

    def list_recordings(self) -> None:
        """Open the list of recordings, which the layout of a run hides."""
        self._client.run_command("ui.expand_blueprint_panel")

    def seek(self, session_ns: int) -> None:
        """Put the cursor of every recording at a time of the session and pause there."""
        session_time = np.timedelta64(int(session_ns), "ns")
        for recording in self.state().recordings:
            self._client.set_time(
                SESSION_TIMELINE, duration=session_time, play_state="paused", recording=recording.store_id
            )

    def state(self) -> ViewerState:
        """Recordings, views and what they report."""
        return self._client.get_state()

    def screenshot(self, view: View | None = None) -> bytes:
        """A PNG of the viewer, or of one view."""
        return self._client.take_screenshot(None if view is None else view.view_id)

    def close(self) -> None:
        """End the viewer and wait until it is gone."""
        if self.process.poll() is None:
            self.process.terminate()
            try:
                self.process.wait(10)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
        self._log.close()


def _all_present(state: ViewerState) -> bool:
    """Whether all that was opened has been loaded: a recording without timelines has not arrived yet."""
    return bool(state.recordings) and not state.loading and all(recording.timelines for recording in state.recordings)


def open_viewer(
    *recordings: Path, miss: int | None = None, false: int | None = None, by: str = "", headless: bool = False
) -> OpenViewer:
    """Show pictures at a miss or a ``false`` contact, ``by`` a detector (else by the first that has it), or the worst.

    The moment is one of the first, which is on the screen; the cursor of every one stands there, and where there are
    several each is listed under the name of its folder. ``headless`` is without a window, for pictures made by
    programs. The close-up needs no command: its camera is in the recording and follows the cursor. Raises
    ``RunFolderError``: there is no recording, or no such moment in it; ``ViewerError``: the viewer cannot be started or
    does not load a recording.
    """
    target = target_ns(recordings[0], miss, false, by)
    for recording in recordings[1:]:
        read_bookmarks(recording)  # a damaged one is refused before a window opens
    viewer = start_viewer(headless=headless)
    try:
        # The viewer shows what was opened last.
        for recording in reversed(recordings):
            viewer.open(recording)
            if recordings[1:]:
                viewer.rename(recording, recording.parent.name)
        if recordings[1:]:
            viewer.list_recordings()
        viewer.seek(target)
    except BaseException:
        viewer.close()
        raise
    return viewer


def target_ns(recording: Path, miss: int | None, false: int | None, by: str) -> int:
    """Nanoseconds on the session timeline; of several detectors that of the first which has the number.

    All misses can be asked for, and those false contacts that are listed.
    """
    moments = read_bookmarks(recording)
    if miss is None and false is None:
        return next((moment.session_ns for moment in moments if moment.leads and by in (moment.label, "")), 0)
    kind, number, plural = ("miss", miss, "misses") if miss is not None else ("false", false, "false contacts")
    matching_moments = [moment for moment in moments if moment.kind == kind and by in (moment.label, "")]
    time_of_number = {moment.number: moment.session_ns for moment in reversed(matching_moments)}
    if number not in time_of_number:
        number_range_clause = (
            f"its {plural} are numbered 1 to {max(time_of_number)}" if time_of_number else "it has none"
        )
        raise RunFolderError(f"there is no {kind} {number} in {recording}; {number_range_clause}")
    return time_of_number[number]


def start_viewer(*, headless: bool = False, size: tuple[int, int] = (1920, 1080)) -> OpenViewer:
    """Start a viewer of our own on a free port of the loopback interface.

    Raises ``ViewerError``: the binary is missing, or ended at once; the message carries its last words.
    """
    port = free_port()
    command = [str(viewer_binary()), "--bind", LOOPBACK, "--port", str(port), "--hide-welcome-screen"]
    if headless:
        command += ["--headless", "--window-size", f"{size[0]}x{size[1]}"]
    log = tempfile.TemporaryFile()  # noqa: SIM115  (the process writes to it as long as the viewer lives)
    process = subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT, env=QUIET_ENVIRONMENT
    )
    try:
        return OpenViewer(process, port, _connect_client(process, port, log), log)
    except BaseException:
        process.kill()
        process.wait()
        log.close()
        raise


def _connect_client(process: subprocess.Popen[bytes], port: int, log: IO[bytes]) -> ViewerClient:
    deadline = time.monotonic() + START_SECONDS
    while True:
        if process.poll() is not None:
            raise ViewerError(_end_sentence(log))
        try:
            client = ViewerClient.connect(f"rerun+http://{LOOPBACK}:{port}/proxy")
            client.get_state()
        except (ConnectionError, RuntimeError) as error:
            if time.monotonic() > deadline:
                raise ViewerError(
                    f"the viewer did not answer in {words.decimal(START_SECONDS, 0)} s ({error}); try again"
                ) from error
            time.sleep(PAUSE_SECONDS)
        else:
            return client


def _end_sentence(log: IO[bytes]) -> str:
    """Why the viewer ended, from what it printed, and what to do."""
    log.seek(0)
    text = log.read().decode("utf-8", "replace")
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    last_line = lines[-1] if lines else "it said nothing"
    why = next((reason for known_text, reason in _KNOWN_ENDS.items() if known_text in text), last_line)
    return f"the viewer ended: {why}; a browser shows the same: `replay share RUN -o DIR`, and open its index.html"


def viewer_binary() -> Path:
    """The viewer that came with rerun-sdk; ``ViewerError`` where the installed wheel has none."""
    package_folder = Path(next(iter(rerun_cli.__path__)))
    names = {"win32": ["rerun.exe"], "darwin": ["Rerun.app/Contents/MacOS/Rerun", "rerun"]}.get(sys.platform, ["rerun"])
    binary = next((package_folder / name for name in names if (package_folder / name).is_file()), None)
    if binary is None:
        reinstall_advice = "reinstall it: pip install --force-reinstall rerun-sdk"
        raise ViewerError(f"rerun-sdk came without its viewer ({package_folder}); {reinstall_advice}")
    return binary


def free_port() -> int:
    """A port of the loopback interface that nobody listens on."""
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
        probe.bind((LOOPBACK, 0))
        port: int = probe.getsockname()[1]
        return port


def notebook_widget() -> Any:
    """The class of Rerun's widget for notebooks. Raises ``OutputError``: the extra ``notebook`` is not installed."""
    os.environ.setdefault("RERUN_NOTEBOOK_ASSET", SERVE)
    try:
        with redirect_stdout(StringIO()):
            import rerun_notebook  # noqa: F401
            from rerun.notebook import Viewer
    except ImportError as error:
        raise OutputError(
            'rerun-notebook is not installed; pip install "vrlab-replay[notebook]", or replay.view(folder) opens it'
        ) from error
    return Viewer


def notebook_viewer(picture: Path, width: int, height: int) -> Any:
    """A widget that shows the recording ``run.rrd`` of a run folder; pixels.

    Raises ``OutputError``: the extra ``notebook`` is not installed.
    """
    widget = notebook_widget()
    read_bookmarks(picture)  # refuses a damaged one
    (store,) = RrdReader(picture).recordings()
    stream = rr.RecordingStream(store.application_id, recording_id=store.recording_id)
    viewer = widget(width=width, height=height, recording=stream)
    stream.log_file_from_path(picture)
    stream.flush()
    return viewer
