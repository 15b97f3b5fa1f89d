import io
import time
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import rerun as rr
from PIL import Image
from rerun.chunk import RrdReader
from support.small_worlds import cubes

from replay.effects.effects_runner import SKIPPED, EffectRun
from replay.effects.output import EffectEvent, EffectOutput, LaneSpan, Liquid, Series
from replay.effects.protocol import EffectSpec
from replay.outputs.rerun_log.columns import RecordingWriter
from replay.outputs.rerun_log.effects import effect_views, log_effects
from replay.outputs.rerun_log.recording import write_recording
from replay.outputs.rerun_log.tradeoff import HEIGHT, WIDTH, Plane, advice_text
from replay.outputs.rerun_log.viewer import NO_ADAPTER, ViewerError, open_viewer
from replay.pipeline.engine import compute
from replay.tradeoffs.settings import Setting
from replay.tradeoffs.sweep import tradeoff

TIMES = np.array([0.0, 0.5, 1.0])
OUTPUT = EffectOutput(
    events=(
        EffectEvent(0.25, "pours", ("cup",)),
        EffectEvent(0.5, "spill", ("cup",), message="3 mL beside", level="warning", point=(1.0, 2.0, 3.0)),
    ),
    series={"cup/volume": Series(TIMES, np.array([3.0, 2.0, np.nan]), "mL")},
    lanes={"cup": (LaneSpan(0.0, 0.5, "pours"), LaneSpan(0.5, 1.0, "spills")), SKIPPED: (LaneSpan(0.5, 1.0, SKIPPED),)},
    liquids={"cup": Liquid(TIMES, np.array([0.05, 0.03, 0.01]), 0.01, 0.02, np.full((3, 4), 200, dtype=np.uint8))},
)
RUNS = {"pour": EffectRun(EffectSpec("pour", "x", lambda i: OUTPUT), ("declared",), OUTPUT, 0.1, {}, 3, 2)}


@pytest.fixture(scope="module")
def entities(tmp_path_factory):
    """Entity path -> rows of the recording."""
    path = tmp_path_factory.mktemp("picture") / "effects.rrd"
    stream = rr.RecordingStream("test")
    stream.save(path)
    log_effects(RecordingWriter(stream, SimpleNamespace()), RUNS)
    stream.disconnect()
    rows: dict[str, list[object]] = {}
    for chunk in RrdReader(str(path)).stream():
        rows.setdefault(str(chunk.entity_path), []).append(chunk.to_record_batch())
    return rows


def values(batches, name):
    for batch in batches:
        for field in batch.schema.names:
            if field.endswith(name):
                return batch.column(field).to_pylist()
    raise AssertionError(f"no {name} in {[batch.schema.names for batch in batches]}")


def test_every_part_of_an_effect_has_an_entity_and_nothing_else_has(entities):
    told = {path for path in entities if path.startswith(("/effects", "/world"))}
    assert told == {
        "/effects/pour/cup/volume", "/effects/pour/lanes/cup", "/effects/pour/lanes/skipped", "/effects/pour/events",
        "/world/effects/pour/1", "/world/cup/liquid",
    }  # fmt: skip


def test_values_and_words_arrive_as_they_are(entities):
    scalars = [row[0] for row in values(entities["/effects/pour/cup/volume"], "scalars")]
    assert scalars[:2] == [3.0, 2.0] and np.isnan(scalars[2])
    assert values(entities["/effects/pour/events"], ":text") == [["pours cup"], ["3 mL beside"]]


def test_only_what_somebody_should_mind_gets_a_marker(entities):
    assert values(entities["/world/effects/pour/1"], "positions") == [[[1.0, 2.0, 3.0]]]


def test_a_liquid_is_a_cylinder_from_the_floor_to_its_level_and_unseen_when_empty(entities):
    batches = entities["/world/cup/liquid"]
    assert np.allclose(np.ravel(values(batches, "lengths")), [0.04, 0.02, 1e-6], atol=1e-7)
    assert np.allclose(np.array(values(batches, "centers")).reshape(-1, 3)[:, 1], [0.03, 0.02, 0.01])
    assert [colour & 255 for colour in np.ravel(values(batches, "colors"))] == [200, 200, 0]


def test_a_lane_goes_from_word_to_word_without_a_gap(entities):
    states = [row[0] for row in values(entities["/effects/pour/lanes/cup"], "state")]
    assert [state for state in states if state] == ["pours", "spills"] and states[-1] == ""


def test_the_tab_gets_a_plot_per_unit_and_every_lane():
    views = effect_views(RUNS)
    assert views.plots == {"mL": ("effects/pour/cup/volume",)} and views.events == ("effects/pour/events",)
    assert views.lanes == ("effects/pour/lanes/cup", "effects/pour/lanes/skipped")


def test_a_vessel_is_drawn_once_as_the_effect_that_ran_last_says():
    from types import SimpleNamespace

    from replay.outputs.rerun_log.effects import _drawn

    runs = {kind: SimpleNamespace(output=SimpleNamespace(liquids=told)) for kind, told in
            (("pour", {"a": "clear", "b": "clear"}), ("colour", {"b": "pink"}))}  # fmt: skip
    assert _drawn(runs) == {"a": "clear", "b": "pink"}


@pytest.fixture(scope="module")
def session():
    return cubes({"a": [0] * 12, "b": [3, 1.3, 1.3, 3, 0.9, 3, 1.3, 1.3, 0.9, 0.8, 1.3, 3]})


@pytest.fixture(scope="module")
def done(session):
    rates = [Setting("discrete", "step rate", f"{hz} Hz", {"rate_hz": hz}) for hz in (10.0, 20.0, 40.0)]
    return tradeoff(session, settings=[Setting("hybrid", "as it comes", ""), *rates], repeats=1)


def test_decades_are_equally_far_apart_and_every_mark_is_inside():
    plane = Plane.of([{"ms_per_frame": 0.004}, {"ms_per_frame": 30.0}])
    assert (plane.low, plane.high) == (-3, 2) and plane.x(0.001) == 0 and plane.x(100.0) == pytest.approx(WIDTH)
    steps = [plane.x(10.0 ** (k + 1)) - plane.x(10.0**k) for k in range(-3, 2)]
    assert steps == pytest.approx([WIDTH / 5] * 5)
    assert (plane.y(1.0), plane.y(0.0)) == (0.0, HEIGHT) and plane.x(0.0) == 0.0


def test_the_recording_holds_a_mark_per_setting_the_front_and_the_advice(session, done, tmp_path):
    run = replace(compute(session, detectors="discrete[rate_hz=20]"), tradeoff=done)
    write_recording(run, tmp_path / "run.rrd")
    paths = {str(chunk.entity_path) for chunk in RrdReader(tmp_path / "run.rrd").stream().to_chunks()}
    plot = {path.removeprefix("/tradeoff/plot/") for path in paths if path.startswith("/tradeoff/plot/")}
    assert {"grid", "budget", "axes", "front/steps", "front/marks", "words", "legend/hybrid", "legend/discrete"} <= plot
    assert sum(path.startswith("lines/") and path.endswith("/marks") for path in plot) == 2
    assert "/tradeoff/advice" in paths


def test_the_words_name_the_front_the_cut_and_the_machine(done):
    told = advice_text(replace(done, cut=("image-space resolution 8",)))
    for words in (*done.advice, *done.front, "Not tried", "image-space resolution 8", "cores"):
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
    try:
        opened = open_viewer(tmp_path, headless=True)
    except ViewerError as error:
        if NO_ADAPTER in str(error):
            pytest.skip(f"no picture can be drawn: {NO_ADAPTER} (Debian: mesa-vulkan-drivers libvulkan1)")
        raise
    with opened:
        for _ in range(20):
            time.sleep(0.5)
            views = opened.state().views
            plane = next((view for view in views if view.view_class == "2D"), None)
            if plane is None:
                continue
            pixels = np.asarray(Image.open(io.BytesIO(opened.screenshot(plane))).convert("RGB"), dtype=np.int16)
            level = (pixels.min(axis=2) > 200).mean(axis=1).max()
            colours = ((pixels.max(axis=2) - pixels.min(axis=2)) > 60).mean()
            if level > 0.5 and colours > 1e-4:
                break
        assert not [(view.name, report.summary) for view in views for report in view.reports]
        assert level > 0.5, "the front runs level from its last point to the right edge; the budget is upright"
        assert colours > 1e-4, "the lines are drawn"
