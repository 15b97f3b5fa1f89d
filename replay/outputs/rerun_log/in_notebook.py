"""The picture of a run inside a notebook, in Rerun's viewer that runs in the browser."""

import os
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any, Final

import rerun as rr
from rerun.chunk import RrdReader

from replay.errors import OutputError

SERVE: Final = "serve-local"
"""The viewer's own files come from the installed package and not from app.rerun.io: a notebook works offline."""


def notebook_viewer(picture: Path, width: int, height: int) -> Any:
    """A widget that shows the recording ``run.rrd`` of a run folder; pixels.

    Raises ``OutputError``: the extra ``notebook`` is not installed.
    """
    os.environ.setdefault("RERUN_NOTEBOOK_ASSET", SERVE)
    try:
        with redirect_stdout(StringIO()):
            import rerun_notebook  # noqa: F401
            from rerun.notebook import Viewer
    except ImportError as error:
        raise OutputError(
            'rerun-notebook is not installed; pip install "vrlab-replay[notebook]", or replay.view(folder) opens it'
        ) from error
    (store,) = RrdReader(picture).recordings()
    stream = rr.RecordingStream(store.application_id, recording_id=store.recording_id)
    viewer = Viewer(width=width, height=height, recording=stream)
    stream.log_file_from_path(picture)
    stream.flush()
    return viewer
