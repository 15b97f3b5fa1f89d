"""Looked at with a headless viewer and browser: what was missed is red in every view, and the README shows today's."""

import re
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
import rerun.blueprint as rrb
from support.first_picture import AROUND, film_picture, opened, record_demo
from support.headless import pixels, viewer_or_skip

from replay.cli.demo import DETECTORS
from replay.comparison.clusters import by_depth
from replay.outputs.rerun_log.recording import write_recording
from replay.pipeline.engine import compute
from replay.studies.synthetic_sessions import synthetic_session

Image = pytest.importorskip("PIL.Image", reason="Pillow reads the pictures: pip install pillow")

ROOT = Path(__file__).parents[2]

pytestmark = pytest.mark.slow


def is_red(picture):
    """Which pixels wear the red of the missed, also as a veil over glass or on a dark ground."""
    r, g, b = np.moveaxis(picture, -1, 0)
    return (r > 150) & (r - g > 90) & (r - b > 50) & (b > g)


def red(picture):
    return int(is_red(picture).sum())


def blue(picture):
    """Pixels of lanes that say *both*."""
    return int((np.abs(picture - [44, 97, 137]).max(axis=-1) < 24).sum())


def view(viewer, title):
    """The view of this title in the open tab; the views of other tabs cannot be photographed."""
    for one in viewer.state().views:
        if re.match(title, one.name):
            with suppress(ConnectionError):
                return pixels(viewer.screenshot(one))
    raise AssertionError(f"no view {title!r} is open")


@pytest.fixture(scope="module")
def audited():
    """What the demo audits, in memory."""
    session, _ = synthetic_session("bench-bumps", 0, None)
    return compute(session, detectors=DETECTORS)


@pytest.fixture(scope="module")
def looking(audited, tmp_path_factory):
    """Makes viewers that have a tab of the run open."""

    def look(tab):
        folder = tmp_path_factory.mktemp("tab")
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(rrb, "Tabs", opened_on(tab))
            write_recording(audited, folder / "run.rrd")
        return viewer_or_skip(opened, folder)

    return look


def opened_on(tab):
    """``Tabs`` that open on the tab of this name; a viewer draws no other."""
    made = rrb.Tabs

    def tabs(*parts, **more):
        names = [one.name for one in parts]
        return made(*parts, **{**more, "active_tab": names.index(tab)} if tab in names else more)

    return tabs


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    with viewer_or_skip(opened, record_demo(tmp_path_factory.mktemp("pictures"))) as viewer:
        yield viewer


def seek(viewer, result, frame):
    """Put the cursor on a frame and wait until it is drawn."""
    # moments of one frame follow each other by nanoseconds; this is after the last
    viewer.seek(int(result.assembly.stamp_ns[frame] - result.assembly.stamp_ns[0]) + 1000)
    time.sleep(3.0)


def yellow(picture):
    """Pixels of lanes and wires that are false contact."""
    r, g, b = np.moveaxis(picture, -1, 0)
    return int(((r > 150) & (g > 120) & (b < 60) & (r - g < 90)).sum())


def test_the_demo_opens_on_the_answer_at_a_false_contact_of_the_worst(demo):
    close = view(demo, "Close-up")
    assert yellow(view(demo, "Where")) > 300 and yellow(close) > 1000
    assert int((close.min(axis=-1) > 235).sum()) > 1000, "the rod is white"
    whole = view(demo, "When")
    assert red(whole) > 1000 < yellow(whole) and blue(whole) > 300
    assert int((view(demo, "The answer").min(axis=-1) > 180).sum()) > 2000
    assert not any(one.reports for one in demo.state().views)


def test_choosing_a_miss_takes_the_close_up_to_it_and_reddens_it(looking, audited):
    deepest = by_depth(audited.misses["mesh50"])[0]
    false = max(audited.false["hull50"], key=lambda one: one.frames)
    with looking("Answer") as viewer:
        seek(viewer, audited, false.widest)
        cage = view(viewer, "Close-up")
        seek(viewer, audited, deepest.deepest)
        faces = view(viewer, "Close-up")
    assert red(faces) > 200 > 100 > red(cage) and yellow(cage) > 1000 > yellow(faces)


def test_the_pipeline_opens_on_its_worked_moment_with_the_missed_contact_in_red(looking):
    with looking("Pipeline") as viewer:
        assert red(view(viewer, "At 5.066 s: a miss")) > 100
        assert int((view(viewer, "This frame").max(axis=-1) > 150).sum()) > 5000


def small(picture):
    """Without the plot of times below, which is another on every machine."""
    picture = picture[: int(0.78 * len(picture))]
    return np.asarray(Image.fromarray(picture.astype(np.uint8)).convert("L").resize((96, 54)), dtype=np.int16)


def test_the_pictures_of_the_readme_are_what_the_demo_looks_like_today(demo):
    shown = re.findall(r"\((\S+/overview\.\w+)\)", (ROOT / "README.md").read_text(encoding="utf-8"))
    assert [Path(one).suffix for one in shown] == [".webp", ".png"]
    screen = Image.fromarray(pixels(demo.screenshot()).astype(np.uint8))
    film = Image.open(ROOT / shown[0])
    assert film.n_frames == 2 * AROUND + 1
    assert (ROOT / shown[0]).stat().st_size < 3e6
    film.seek(AROUND)
    for kept, now in ((film, film_picture(screen)), (Image.open(ROOT / shown[1]), screen)):
        kept, now = (small(np.asarray(one.convert("RGB"))) for one in (kept, now))
        assert np.abs(kept - now).mean() < 2.5, "make it anew: tests/support/first_picture.py"
        assert np.abs(kept[:, ::-1] - now).mean() > 7.5, "so much differs in a picture that is not the same"


def test_the_recording_of_the_demo_is_small(audited, tmp_path):
    write_recording(audited, tmp_path / "run.rrd")
    assert (tmp_path / "run.rrd").stat().st_size < 10_000_000
