"""The demo as a viewer shows it; ``python tests/support/first_picture.py .github/pictures`` makes README's pictures.

``overview.png`` is the worst moment, ``overview.webp`` its upper part played at a quarter of the speed.
"""

import io
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image

from replay.outputs.rerun_log.moment_table import read_moments
from replay.outputs.rerun_log.viewer import OpenViewer, open_viewer

FILM_HZ, SLOWER, AROUND = 6, 4, 36
"""Pictures a second, how much slower than life, and pictures before and after the moment."""
FILM_PART, FILM_SIZE = (0, 60, 1920, 820), (1152, 456)
"""What is filmed of the screen, the answer, the scene and the lanes, and how large."""
DRAWN = 0.25
"""Seconds until the viewer has drawn a moment."""

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
    viewer = open_viewer(run_folder, miss=miss, headless=True)
    time.sleep(TOASTS_GONE)
    return viewer


def played(viewer: OpenViewer, around_ns: int) -> list[Image.Image]:
    """Pictures around a moment, for a film at a quarter of the speed."""
    frames = []
    for k in range(-AROUND, AROUND + 1):
        viewer.seek(max(0, around_ns + round(k * 1e9 / FILM_HZ / SLOWER)))
        time.sleep(DRAWN)
        frames.append(film_picture(picture(viewer)))
    return frames


def film_picture(screen: Image.Image) -> Image.Image:
    """A screen as the film has it."""
    return screen.crop(FILM_PART).resize(FILM_SIZE, Image.Resampling.LANCZOS)


def picture(viewer: OpenViewer) -> Image.Image:
    """What the viewer shows now."""
    return Image.open(io.BytesIO(viewer.screenshot())).convert("RGB")


def main(out: Path) -> None:
    """Record, look, keep."""
    with TemporaryDirectory() as folder, opened(run := record_demo(Path(folder))) as viewer:
        picture(viewer).save(out / "overview.png", optimize=True)
        worst = next(one for one in read_moments(run / "run.rrd") if one.leads)
        first, *rest = played(viewer, worst.session_ns)
        first.save(
            out / "overview.webp", save_all=True, append_images=rest, duration=round(1000 / FILM_HZ), loop=0,
            quality=62, method=6,
        )  # fmt: skip


if __name__ == "__main__":
    main(Path(sys.argv[1]))
