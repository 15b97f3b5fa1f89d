"""Looked at with a headless viewer and browser: what was missed is red in every view, and the README shows today's."""

import re
import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import rerun.blueprint as rrb
from support.first_picture import AROUND, TOASTS_GONE, film_picture, opened, record_demo
from support.headless import photographed, pixels, viewer_or_skip
from support.sentences import recording_text
from support.small_worlds import jumping

from replay.cli.demo import DETECTORS
from replay.comparison.clusters import by_depth
from replay.outputs.palette import SERIES
from replay.outputs.report.page import report_html
from replay.outputs.rerun_log.overview import read_moments
from replay.outputs.rerun_log.recording import write_recording
from replay.outputs.rerun_log.viewer import start_viewer
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


def laned(picture, colour):
    """Pixels of lanes of this colour, which the viewer draws darker."""
    return wears(picture, [0.8 * one for one in colour[:3]])


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


@pytest.fixture(scope="module")
def audit(looking, audited):
    with looking("Audit: mesh50") as viewer:
        seek(viewer, audited, by_depth(audited.misses["mesh50"])[0].deepest)
        yield viewer


def seek(viewer, result, frame):
    """Put the cursor on a frame and wait until it is drawn."""
    # moments of one frame follow each other by nanoseconds; this is after the last
    viewer.seek(int(result.assembly.stamp_ns[frame] - result.assembly.stamp_ns[0]) + 1000)
    time.sleep(3.0)


SHOWN = {
    "Where: red missed by mesh50": 100, "Close-up: the nearest miss": 300,
    "When and which pair    red: missed by mesh50": 1000, "0.6 s around": 60,
    "mesh50 missed ": 500,
}  # fmt: skip
"""View -> pixels of red at least, a third of what there are."""


@pytest.mark.parametrize("title", SHOWN)
def test_what_was_missed_is_red_in_every_view_of_the_audit(audit, title):
    assert red(view(audit, title)) >= SHOWN[title]


def test_lanes_hold_what_both_found_and_the_note_is_read_in_white(audit):
    assert blue(view(audit, "When and which")) > 300
    note = view(audit, "The miss in the close-up")
    assert int((note.min(axis=-1) > 180).sum()) > 300 and red(note) == 0


def yellow(picture):
    """Pixels of lanes and wires that are false contact."""
    r, g, b = np.moveaxis(picture, -1, 0)
    return int(((r > 150) & (g > 120) & (b < 60) & (r - g < 90)).sum())


def test_the_demo_opens_on_the_answer_at_a_false_contact_of_the_worst(demo):
    assert yellow(view(demo, "Where: red missed")) > 300 and yellow(view(demo, "Close-up    wires")) > 1000
    assert yellow(view(demo, "The pair in focus")) > 3000
    whole = view(demo, "When    red")
    assert red(whole) > 1000 < yellow(whole) and blue(whole) > 300
    answer = view(demo, "Answer")
    assert int((answer.min(axis=-1) > 180).sum()) > 2000
    assert not any(one.reports for one in demo.state().views)


def test_choosing_a_moment_moves_lanes_close_up_and_words(looking, audited):
    deepest = by_depth(audited.misses["mesh50"])[0]
    false = max(audited.false["hull50"], key=lambda one: one.frames)
    titles, seen = ("Close-up    wires", "The pair in focus", "The moment in the close-up"), []
    with looking("Answer") as viewer:
        for frame in (false.widest, deepest.deepest):
            seek(viewer, audited, frame)
            seen.append([view(viewer, title) for title in titles])
    (wires, lanes, note), (faces, other, words) = seen
    # what was found late is pink
    pink = [int(((one[..., 0] - one[..., 1] > 60) & (one[..., 0] > one[..., 2] + 40)).sum())
            for one in (faces, wires)]  # fmt: skip
    assert pink[0] > 300 > 100 > pink[1] and yellow(wires) > 1000
    assert red(other) > 20 and yellow(lanes) > 3000
    assert np.abs(note - words).max() > 200


def lines_of(picture):
    """How many lines of text a view has, by rows of pixels that are bright somewhere."""
    bright = (picture.min(axis=-1) > 170).sum(axis=1) > 2
    return int((np.diff(bright.astype(int)) == 1).sum())


@pytest.mark.parametrize("size", [(1280, 800), (1920, 1080)])
def test_what_when_where_why_and_cost_are_read_without_a_click(audited, tmp_path, size):
    write_recording(audited, tmp_path / "run.rrd")
    (answer,) = re.findall(r"## hull50: .*", recording_text(tmp_path / "run.rrd"))
    assert answer.startswith("## hull50: ") and "% of the contact time it reports is false" in answer
    lead = next(one for one in read_moments(tmp_path / "run.rrd") if one.leads)
    with viewer_or_skip(start_viewer, headless=True, size=size) as viewer:
        viewer.open(tmp_path / "run.rrd")
        viewer.seek(lead.session_ns)
        time.sleep(TOASTS_GONE)
        titles = ("Answer", "Where", "Close-up    wires", "The pair in focus", "When    red", "The moment in")
        what, where, near, pair, when, why = (view(viewer, title) for title in titles)
    assert min(len(pair), len(when)) >= 24 + 4 * 40, "a ruler and four lanes"
    assert lines_of(what) >= 8, "title, why, cost, and the row of every detector"
    assert (what[-4:].min(axis=-1) > 170).sum() == 0, "no line is cut"
    assert yellow(where) > 200 and yellow(near) > 200 and yellow(pair) > 2000
    assert red(when) > 500 < yellow(when) and lines_of(why) >= 3


def test_the_effects_open_at_what_happened_with_stages_tasks_and_the_liquid(tmp_path):
    session, _ = synthetic_session("titration", 0, None)
    write_recording(compute(session, detectors=()), tmp_path / "run.rrd")
    with viewer_or_skip(start_viewer, headless=True, size=(1280, 800)) as viewer:
        viewer.open(tmp_path / "run.rrd")
        viewer.seek(next(one.session_ns for one in read_moments(tmp_path / "run.rrd") if one.leads))
        time.sleep(TOASTS_GONE)
        room, lanes = pixels(viewer.screenshot())[200:600, :640], view(viewer, "When: what")
        words = view(viewer, "Answer: what")
    r, g, b = np.moveaxis(room, -1, 0)
    assert int(((r - g > 20) & (b - g > 20)).sum()) > 500, "the liquid is pink"
    assert all(laned(lanes, colour) > 300 for colour in SERIES[:5]) and lines_of(words) >= 2


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


def test_a_miss_between_frames_is_red_at_its_moment_and_not_before(tmp_path):
    write_recording(compute(jumping(), detectors="exact", oracle="continuous"), tmp_path / "run.rrd")
    (miss,) = (one for one in read_moments(tmp_path / "run.rrd") if one.kind == "miss")
    with viewer_or_skip(opened, tmp_path, 1) as viewer:
        there = red(view(viewer, "Close-up: the moment"))
        viewer.seek(miss.session_ns - 1)
        time.sleep(1.5)
        before = red(view(viewer, "Close-up: the moment"))
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
        listed = view(viewer, "Moments")
        lanes, near = view(viewer, "When    red"), view(viewer, "The pair in focus")
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


def test_the_recording_of_the_demo_is_small(audited, tmp_path):
    write_recording(audited, tmp_path / "run.rrd")
    assert (tmp_path / "run.rrd").stat().st_size < 10_000_000


def pictures_of(viewer):
    """The three pictures of the tab *Pipeline*, of one screenshot: near bodies, the search, the frame in numbers."""
    whole = pixels(viewer.screenshot())
    height, width = whole.shape[:2]
    upper = whole[height // 10 : int(0.65 * height)]
    return upper[:, : int(0.32 * width)], upper[:, int(0.34 * width) : int(0.70 * width)], upper[:, int(0.72 * width) :]


def test_the_tab_pipeline_shows_spheres_and_a_search_that_ends_green_or_red(looking, audited):
    (watched,) = watched_runs(audited)
    first = {kind: next(one for one in watched.moments if one.kind == kind) for kind in ("contact", "missed")}
    with looking("Pipeline") as viewer:
        seen = {}
        for kind, moment in first.items():
            seek(viewer, audited, moment.frame)
            seen[kind] = pictures_of(viewer)
        assert not any(one.reports for one in viewer.state().views)
    near, search, frame = zip(*(seen[kind] for kind in ("contact", "missed")), strict=True)
    assert red(search[1]) > 100 > 20 > red(search[0])
    assert wears(search[0], SERIES[2]) > 100
    assert all(wears(one, SERIES[0]) > 300 for one in near)
    assert all(wears(one, SERIES[0]) > 200 and wears(one, SERIES[1]) > 200 for one in frame)
    assert red(near[1]) > 20 and not any(red(one) for one in (near[0], *frame)), "the line of the missed pair"
