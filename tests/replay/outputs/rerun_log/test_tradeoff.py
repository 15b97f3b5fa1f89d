import time
from dataclasses import replace

import pytest
from rerun.chunk import RrdReader
from support.headless import pixels, viewer_or_skip
from support.small_worlds import cubes

from replay.outputs.rerun_log.recording import write_recording
from replay.outputs.rerun_log.tradeoff import ROOTS, advice_text
from replay.outputs.rerun_log.viewer import open_viewer
from replay.outputs.tradeoff_table import how_measured
from replay.pipeline.engine import compute
from replay.tradeoffs.settings import Setting
from replay.tradeoffs.sweep import tradeoff


@pytest.fixture(scope="module")
def session():
    return cubes({"a": [0] * 12, "b": [3, 1.3, 1.3, 3, 0.9, 3, 1.3, 1.3, 0.9, 0.8, 1.3, 3]})


@pytest.fixture(scope="module")
def done(session):
    rates = [Setting("discrete", "step rate", f"{hz} Hz", {"rate_hz": hz}) for hz in (40.0, 60.0, 80.0)]
    return tradeoff(session, settings=[Setting("hybrid", "as it comes", ""), *rates], repeats=1)


def test_the_recording_holds_both_plots_and_the_advice(session, done, tmp_path):
    run = replace(compute(session, detectors="discrete[rate_hz=20]"), tradeoff=done)
    write_recording(run, tmp_path / "run.rrd")
    paths = {str(chunk.entity_path) for chunk in RrdReader(tmp_path / "run.rrd").stream().to_chunks()}
    for root in ROOTS:
        plot = {path.removeprefix(f"/{root}/") for path in paths if path.startswith(f"/{root}/")}
        assert {"grid", "axes", "curves/first", "marks/best", "intervals/best", "words/best", "words/first"} <= plot
        assert ("budget" in plot) == (root == "tradeoff/live")
    assert "/tradeoff/advice" in paths


def test_the_words_name_the_answer_the_front_the_cut_the_clock_and_the_machine(done):
    told = advice_text(replace(done, cut=("qaco",)))
    for words in (done.answer, *done.advice, *done.front, "Not tried", "qaco", "cores", *how_measured(done)):
        assert words in told
    assert told.count("\n| ") >= len(done.rows) + len(done.front)
    for number, label in enumerate(done.front, 1):
        assert f"\n| {number} | {label} | " in told


@pytest.mark.slow
def test_a_viewer_draws_the_curve_and_reports_no_error(session, done, tmp_path, monkeypatch):
    import rerun.blueprint as rrb

    from replay.outputs.rerun_log import recording
    from replay.outputs.rerun_log.tradeoff import curve_tab

    # The curve alone, in front: a tab behind another is not drawn.
    alone = rrb.Blueprint(curve_tab(), auto_views=False, auto_layout=False)
    monkeypatch.setattr(recording, "build_blueprint", lambda layout: alone)
    write_recording(replace(compute(session, detectors="discrete[rate_hz=20]"), tradeoff=done), tmp_path / "run.rrd")
    with viewer_or_skip(open_viewer, tmp_path, headless=True) as opened:
        for _ in range(20):
            time.sleep(0.5)
            views = opened.state().views
            plane = next((view for view in views if view.view_class == "2D"), None)
            if plane is None:
                continue
            picture = pixels(opened.screenshot(plane))
            level = (picture.min(axis=2) > 45).mean(axis=1).max()
            colours = ((picture.max(axis=2) - picture.min(axis=2)) > 60).mean()
            if level > 0.5 and colours > 1e-4:
                break
        assert not [(view.name, report.summary) for view in views for report in view.reports]
        assert level > 0.5, "the grid runs level from edge to edge"
        assert colours > 1e-4, "the lines are drawn"
