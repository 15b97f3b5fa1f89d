import time
from dataclasses import replace

import pytest
from rerun.chunk import RrdReader
from support.headless import pixels, viewer_or_skip
from support.small_worlds import cubes

from replay.outputs.report.drawing import DARK
from replay.outputs.report.tradeoff_picture import picture
from replay.outputs.rerun_log.recording import write_recording
from replay.outputs.rerun_log.tradeoff import advice_text
from replay.outputs.rerun_log.viewer import open_viewer
from replay.pipeline.engine import compute
from replay.tradeoffs.settings import Setting
from replay.tradeoffs.sweep import tradeoff


@pytest.fixture(scope="module")
def session():
    return cubes({"a": [0] * 12, "b": [3, 1.3, 1.3, 3, 0.9, 3, 1.3, 1.3, 0.9, 0.8, 1.3, 3]})


@pytest.fixture(scope="module")
def done(session):
    rates = [Setting(f"{hz} Hz", "discrete", {"rate_hz": hz}, "rates", f"{hz}") for hz in (40.0, 60.0, 80.0)]
    return tradeoff(session, settings=[Setting("FCL", "hybrid"), *rates])


def test_the_recording_holds_the_picture_and_the_advice(session, done, tmp_path):
    run = replace(compute(session, detectors="discrete[rate_hz=20]"), tradeoff=done)
    write_recording(run, tmp_path / "run.rrd")
    held = {}
    for chunk in RrdReader(tmp_path / "run.rrd").stream().filter(content="/tradeoff/**").to_chunks():
        batch = chunk.to_record_batch()
        held |= {(str(chunk.entity_path), name): batch.column(name).to_pylist()[0] for name in batch.schema.names}
    (blob,) = held["/tradeoff/plots", "EncodedImage:blob"]
    assert bytes(blob) == picture(done, "png", DARK, beside_words=True)
    assert held["/tradeoff/advice", "TextDocument:text"] == [advice_text(done)]


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
            seen = pixels(opened.screenshot(plane))
            colours = ((seen.max(axis=2) - seen.min(axis=2)) > 60).mean()
            if colours > 1e-3:
                break
        assert not [(view.name, report.summary) for view in views for report in view.reports]
        assert colours > 1e-3, "the lines are drawn"
