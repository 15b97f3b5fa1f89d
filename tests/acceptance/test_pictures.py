"""Looked at with a headless viewer and browser: what was missed is red in every view, and the README shows today's."""

import re
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import rerun.blueprint as rrb
from support.first_picture import opened, record_demo
from support.headless import photographed, pixels, viewer_or_skip
from support.small_worlds import jumping

from replay.outputs.palette import SERIES
from replay.outputs.report.page import report_html
from replay.outputs.rerun_log.focus import read_misses
from replay.outputs.rerun_log.recording import write_recording
from replay.outputs.watched_run import watched_runs
from replay.pipeline.engine import compute
from replay.studies.synthetic_sessions import synthetic_session
from sessions.synthetic import make_analytic

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


def wears(picture, colour):
    """Pixels of this colour."""
    return int((np.abs(picture - np.array(colour[:3])).max(axis=-1) < 24).sum())


def view(viewer, title):
    return pixels(viewer.screenshot(next(one for one in viewer.state().views if re.match(title, one.name))))


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    with viewer_or_skip(opened, record_demo(tmp_path_factory.mktemp("pictures"))) as viewer:
        yield viewer


SHOWN = {
    "Where: ": 100, "Close-up: ": 300, "When and which": 1000, "0.6 s around": 60, r"\d+ of \d+ contacts missed": 500,
}  # fmt: skip
"""View -> pixels of red at least, a third of what there are."""


@pytest.mark.parametrize("title", SHOWN)
def test_what_was_missed_is_red_in_every_view_of_the_audit(demo, title):
    assert red(view(demo, title)) >= SHOWN[title]


def test_lanes_hold_what_both_found_and_the_note_is_read_in_white(demo):
    assert blue(view(demo, "When and which")) > 300
    note = view(demo, "The miss in the close-up")
    assert int((note.min(axis=-1) > 180).sum()) > 300 and red(note) == 0


def small(picture):
    """Without the plot of times below, which is another on every machine."""
    picture = picture[: int(0.78 * len(picture))]
    return np.asarray(Image.fromarray(picture.astype(np.uint8)).convert("L").resize((96, 54)), dtype=np.int16)


def test_the_first_picture_of_the_readme_is_what_the_demo_looks_like_today(demo):
    place = re.search(r"!\[[^\]]*\]\(([^)]+\.png)\)", (ROOT / "README.md").read_text(encoding="utf-8"))
    kept = small(np.asarray(Image.open(ROOT / place[1]).convert("RGB")))
    now = small(pixels(demo.screenshot()))
    assert np.abs(kept - now).mean() < 2.5, "make it anew: tests/support/first_picture.py"
    assert np.abs(kept[:, ::-1] - now).mean() > 7.5, "so much differs in a picture that is not the same"


def test_a_miss_between_frames_is_red_at_its_moment_and_not_before(tmp_path):
    write_recording(compute(jumping(), detectors="exact", oracle="continuous"), tmp_path / "run.rrd")
    (miss,) = read_misses(tmp_path / "run.rrd")
    with viewer_or_skip(opened, tmp_path, 1) as viewer:
        there = red(view(viewer, "Close-up"))
        viewer.seek(miss.session_ns - 1)
        time.sleep(1.5)
        before = red(view(viewer, "Close-up"))
    assert there > 300 > 10 > before


@pytest.fixture(scope="module")
def hundreds():
    """A ball on a plate for a minute and a half, of which every seventh frame of contact is lost."""
    session, _ = make_analytic("ball-plate", seconds=90.0)
    result = compute(session, detectors="it=support.planted_detectors:Dropping")
    assert len(result.misses["it"]) > 200
    return result


def test_hundreds_of_misses_are_clusters_and_numbers_in_red(hundreds, tmp_path):
    write_recording(hundreds, tmp_path / "run.rrd")
    with viewer_or_skip(opened, tmp_path) as viewer:
        listed = view(viewer, r"\d+ of \d+ contacts missed|.* missed in part")
        lanes, near = view(viewer, "When and which"), view(viewer, "0.6 s around")
    assert int(((listed - listed[..., 1:2])[..., 0] > 60).sum()) > 500
    assert is_red(lanes).mean(axis=1).max() > 0.3, "the numbers fill their lane"
    assert blue(near) > 300 and red(near) > 60


def test_hundreds_of_misses_are_a_page_that_ends_with_the_clusters(hundreds, tmp_path):
    none = replace(hundreds, misses={"it": hundreds.misses["it"][:1]})
    heights = []
    for result in (hundreds, none):
        page = report_html(result)
        assert len(page) < 1_500_000
        picture, _ = photographed(page, tmp_path, "1280,9000")
        heights.append(int(np.flatnonzero((picture < 200).any(axis=(1, 2)))[-1]))
        assert red(picture) > 500
    assert heights[0] < heights[1] + 45 * 40 and heights[0] < 8900, "a row per cluster, and all others folded"


def opened_on(tab):
    """``Tabs`` that open on the tab of this name; a viewer draws no other."""
    made = rrb.Tabs

    def tabs(*parts, **more):
        names = [one.name for one in parts]
        return made(*parts, **{**more, "active_tab": names.index(tab)} if tab in names else more)

    return tabs


@pytest.fixture(scope="module")
def pipeline(tmp_path_factory):
    """The paper's pipeline on the session of the demo, its colony alone, which misses; opened on its tab."""
    session, _ = synthetic_session("bench-bumps", 0, None)
    result = compute(session, detectors="paper=hybrid-qaco[variant=corrected]")
    folder = tmp_path_factory.mktemp("pipeline")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rrb, "Tabs", opened_on("Pipeline"))
        write_recording(result, folder / "run.rrd")
    return result, folder


def test_the_pipeline_of_the_demo_is_small(pipeline):
    assert (pipeline[1] / "run.rrd").stat().st_size < 10_000_000


def pictures_of(viewer):
    """The three pictures of the tab *Pipeline*, of one screenshot: near bodies, the search, the frame in numbers."""
    whole = pixels(viewer.screenshot())
    height, width = whole.shape[:2]
    upper = whole[height // 10 : int(0.65 * height)]
    return upper[:, : int(0.32 * width)], upper[:, int(0.34 * width) : int(0.70 * width)], upper[:, int(0.72 * width) :]


def test_the_tab_pipeline_shows_spheres_and_a_search_that_ends_green_or_red(pipeline):
    result, folder = pipeline
    (watched,) = watched_runs(result, all_looks=False)
    first = {kind: next(one for one in watched.moments if one.kind == kind) for kind in ("contact", "missed")}
    with viewer_or_skip(opened, folder) as viewer:
        ns = result.assembly.stamp_ns - result.assembly.stamp_ns[0]
        seen = {}
        for kind, moment in first.items():
            viewer.seek(int(ns[moment.frame]))
            time.sleep(3.0)
            seen[kind] = pictures_of(viewer)
        assert not any(one.reports for one in viewer.state().views)
    near, search, frame = zip(*(seen[kind] for kind in ("contact", "missed")), strict=True)
    assert red(search[1]) > 100 > 20 > red(search[0])
    assert wears(search[0], SERIES[2]) > 100
    assert all(wears(one, SERIES[0]) > 300 for one in near)
    assert all(wears(one, SERIES[0]) > 200 and wears(one, SERIES[1]) > 200 for one in frame)
    assert not any(red(one) for one in (*near, *frame))
