"""The demo as a viewer shows it; ``python tests/support/first_picture.py OUT.png`` makes the README's first picture."""

import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from replay.outputs.rerun_log.viewer import OpenViewer, open_viewer

TOASTS_GONE = 14.0
"""Seconds until the viewer's own messages have left the picture."""


def record_demo(folder: Path) -> Path:
    """The demo's run folder, made as the README says."""
    out = folder / "demo"
    subprocess.run(
        [sys.executable, "-m", "replay", "demo", "-q", "-o", str(out)], check=True, stdout=subprocess.DEVNULL
    )
    return out


def opened(run_folder: Path, miss: int | None = None) -> OpenViewer:
    """A run in a headless viewer without messages."""
    viewer = open_viewer(run_folder, miss, headless=True)
    time.sleep(TOASTS_GONE)
    return viewer


def main(out: Path) -> None:
    """Record, look, keep."""
    import io

    from PIL import Image

    with TemporaryDirectory() as folder, opened(record_demo(Path(folder))) as viewer:
        Image.open(io.BytesIO(viewer.screenshot())).convert("RGB").save(out, optimize=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
