"""Looked at with a headless viewer and browser: each tab opens on what it is about; README shows today's demo."""

import re
import time
from contextlib import suppress
from pathlib import Path
from shutil import which

import numpy as np
import pytest
import rerun.blueprint as rrb
from support.processes import script
from support.viewers import pixels, viewer_or_skip

from replay.auditing.fault import worst_first
from replay.engine import compute
from replay.show.rerun_log.recording import write_recording
from replay.show.rerun_log.viewer import open_viewer
from replay.studies.synthetic_sessions import synthetic_session

Image = pytest.importorskip("PIL.Image", reason="Pillow reads the pictures: pip install pillow")

ROOT = Path(__file__).parents[2]

pytestmark = pytest.mark.slow


def count_red_pixels(picture):
    """Pixels in the red of the missed, also as a veil over glass or on a dark ground."""
    r, g, b = np.moveaxis(picture, -1, 0)
    return int(((r > 150) & (r - g > 90) & (r - b > 50) & (b > g)).sum())


def count_yellow_pixels(picture):
    """Pixels of lanes and wires that are false contact."""
    r, g, b = np.moveaxis(picture, -1, 0)
    return int(((r > 150) & (g > 120) & (b < 60) & (r - g < 90)).sum())


def count_light_pixels(picture, least=180):
    """Pixels of words, or, with a ``least`` of 235, of a white body."""
    return int((picture.min(axis=-1) > least).sum())


def view(viewer, title):
    """The view of this title in the open tab, once it is drawn; the views of other tabs cannot be photographed."""
    for _ in range(20):
        for item in viewer.state().views:
            if re.match(title, item.name):
                with suppress(ConnectionError):
                    return pixels(viewer.screenshot(item))
        time.sleep(0.5)
    raise AssertionError(f"no view {title!r} is open")


@pytest.fixture(scope="module")
def demo_audit():
    """The audit of the demo's made-up session, in memory; its worst detector is hulls at 50 Hz, by false contact."""
    session, _ = synthetic_session("bench-bumps", seed=0, noise=None)
    return compute(session)


@pytest.fixture(scope="module")
def open_tab(demo_audit, tmp_path_factory):
    """Returns a viewer without a window, which has the recording of the run open at the tab of this name."""
    tabs = rrb.Tabs

    def opened_tab(tab):
        def opened_on(*contents, **more):
            names = [item.name for item in contents]
            return tabs(*contents, **{**more, "active_tab": names.index(tab)} if tab in names else more)

        folder = tmp_path_factory.mktemp("tab")
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(rrb, "Tabs", opened_on)
            write_recording(demo_audit, folder / "run.rrd")
        assert (folder / "run.rrd").stat().st_size < 10_000_000
        viewer = viewer_or_skip(open_viewer, folder / "run.rrd", headless=True)
        time.sleep(5.0)
        return viewer

    return opened_tab


def test_answer_tab_opens_on_false_contact_and_seeks_to_misses(open_tab, demo_audit):
    """The close-up opens on false contact: a yellow cage, the hull, about a white rod, and no red; the lanes have both.

    At the worst miss of meshes at 50 Hz it is red, and hardly yellow. Counts are pixels of a colour; the limits are far
    below what is drawn and far above stray pixels at edges. No view reports a problem.
    """
    worst_miss = worst_first(demo_audit.misses["mesh50"])[0]
    after_the_miss_ns = demo_audit.assembly.stamp_ns[worst_miss.frame] - demo_audit.assembly.stamp_ns[0] + 1000
    with open_tab("Answer") as viewer:
        close_up, lanes = view(viewer, "Close-up"), view(viewer, "When")
        assert count_yellow_pixels(close_up) > 1000 and count_light_pixels(close_up, least=235) > 1000
        assert count_red_pixels(close_up) < 100
        assert count_yellow_pixels(view(viewer, "Where")) > 300
        assert count_light_pixels(view(viewer, "The answer")) > 2000
        assert count_red_pixels(lanes) > 150 and count_yellow_pixels(lanes) > 1000
        assert not any(item.reports for item in viewer.state().views)
        # Moments of a frame follow each other by nanoseconds; this is after the last.
        viewer.seek(int(after_the_miss_ns))
        time.sleep(3.0)
        miss = view(viewer, "Close-up")
    assert count_red_pixels(miss) > 200 and count_yellow_pixels(miss) < 1000


def test_pipeline_opens_on_the_missed_contact_in_red(open_tab):
    """A miss of the paper's pipeline is drawn in red, and the table "This frame" has text; no view reports a problem.

    Counts are pixels of a colour, with limits far above stray ones at edges.
    """
    with open_tab("Pipeline") as viewer:
        assert count_red_pixels(view(viewer, r"At [\d.]+ s: a miss")) > 100
        this_frame = view(viewer, "This frame")
        bright_pixels = int((this_frame.max(axis=-1) > 150).sum())
        assert bright_pixels > 1500
        assert not any(item.reports for item in viewer.state().views)


@pytest.mark.skipif(not (which("chromium") or which("chromium-browser")), reason="Chromium draws it")
def test_readme_picture_is_reproduced_by_its_command(demo_audit, tmp_path):
    """The picture of the README is drawn again from the demo: at a tenth of the size they differ by less than 2 of 255.

    In the mean of all pixels; mirrored, as another picture, they differ by more than 7.5. It has 1800 x 760 pixels in
    less than 400 kB, with clear corners, for any ground, about what it shows.
    """
    (picture_file,) = re.findall(r"\((\S+/answer\.png)\)", (ROOT / "README.md").read_text(encoding="utf-8"))
    picture = Image.open(ROOT / picture_file)
    assert picture.size == (1800, 760)
    assert (ROOT / picture_file).stat().st_size < 400_000

    drawn_again = Image.open(script("readme_picture").drawn_picture(demo_audit, tmp_path / "answer.png"))
    small, small_again = (
        np.asarray(image.convert("RGBA").resize((180, 76)), dtype=np.int16) for image in (picture, drawn_again)
    )
    mirrored = small[:, ::-1]
    assert np.abs(small - small_again).mean() < 2.0, "make it anew: .ci/readme_picture.py"
    assert np.abs(mirrored - small_again).mean() > 7.5

    corner_opacity, middle_opacity = picture.convert("RGBA").getpixel((0, 0))[3], small[38, 90, 3]
    assert corner_opacity == 0 < middle_opacity
