"""Every row of the table of detectors says all that the tool must know of it."""

from dataclasses import asdict

import numpy as np
import pytest
from support.optional import ENGINE_MODULE, ROWS
from support.shapes import lab_bodies_and_motion

from cdcore import create_detector
from cdcore.detectors.detector_table import OPTIONAL, TABLE, DetectorRow, detector_row, load_detector, settings_of
from cdcore.engines.engine_detector import EngineDetector
from cdcore.errors import InvalidSettingError
from cdcore.protocol.settings import RateSettings
from replay.advice.settings import Setting
from replay.detection.detector_spec import parse_detector, spec_text
from replay.document.detector_labels import detector_label
from replay.show.rerun_log.timing import STAGE_LABELS
from replay.studies.stress.runner import ALL_DETECTORS, detectors_of

FIELD_STAGES = {
    "broad phase", "narrow phase", "containment", "traversal", "search", "faces", "poses", "images", "engine", "frames",
    "between",
}  # fmt: skip
"""Names of stages that a reader of the field knows."""


def faults_of(name, row):
    """Problems of a row: fields that it lacks."""
    detector = load_detector(name)
    faults = []
    if not row.label or row.label == name:
        faults.append("a label")
    if row.contact_offset and not hasattr(settings_of(name, {}), row.contact_offset):
        faults.append(f"the setting {row.contact_offset}")
    if bool(row.contact_offset) != (detector.contact_reach is not load_detector("exact").contact_reach):
        faults.append("a contact offset with its reach")
    if issubclass(detector, EngineDetector) != bool(row.engine and row.extra):
        faults.append("the engine and its extra")
    if row.sampled and not issubclass(detector.Settings, RateSettings):
        faults.append("a rate")
    if not getattr(detector, "stages", ()):
        faults.append("its stages")
    return faults


@pytest.mark.parametrize("name", TABLE)
def test_every_row_of_the_detector_table_is_complete(name):
    """``faults_of`` names what a row lacks: its label, contact offset and reach, engine and extra, rate, stages."""
    assert faults_of(name, TABLE[name]) == []


@pytest.mark.parametrize("name", TABLE)
def test_check_of_rows_names_what_a_bare_row_lacks(name):
    """A row of nothing but its entry lacks a label and, where the detector has them, contact offset and engine."""
    row = TABLE[name]
    bare = DetectorRow(entry=row.entry, label="")
    lacking = {"a label"}
    lacking |= {"a contact offset with its reach"} if row.contact_offset else set()
    lacking |= {"the engine and its extra"} if row.engine else set()
    assert set(faults_of(name, bare)) == lacking


@pytest.mark.parametrize("name", TABLE)
def test_labels_of_rows_differ(name):
    """A detector from outside the table is labelled by its own name."""
    assert [other for other in TABLE if TABLE[other].label == TABLE[name].label] == [name]
    assert detector_label("outside:Engine", {}) == "outside:Engine"


@pytest.mark.parametrize("name", [name for name in TABLE if TABLE[name].complete_with is not None])
def test_settings_that_make_a_detector_complete_are_accepted(name):
    """With ``complete_with`` a detector misses no contact at a frame; with another value of any of them it may."""
    needs = dict(TABLE[name].complete_with)
    settings_of(name, needs)
    assert Setting(spec_text(name, needs), name, needs).complete
    for key in needs:
        assert not Setting("other", name, needs | {key: "no such value"}).complete


@pytest.mark.parametrize("name", ROWS)
def test_a_contact_offset_widens_the_reach(name):
    """5 cm reach farther than the default; 0 no farther, or it is refused; a detector without an offset reaches 0 m."""
    row, (bodies, _) = detector_row(name), lab_bodies_and_motion(frames=2)
    reach = create_detector(name, bodies).contact_reach(0)
    if not row.contact_offset:
        assert reach == 0.0
        return
    assert create_detector(name, bodies, **{row.contact_offset: 0.05}).contact_reach(0) > reach
    if row.takes_no_offset:
        assert create_detector(name, bodies, **{row.contact_offset: 0.0}).contact_reach(0) <= reach
    else:
        with pytest.raises(InvalidSettingError):
            settings_of(name, {row.contact_offset: 0.0})


@pytest.mark.parametrize("name", ROWS)
def test_detector_times_only_its_declared_stages(name):
    """FIELD_STAGES are words of the field; STAGE_LABELS translates a detector's own names into them."""
    bodies, motion = lab_bodies_and_motion(frames=4)
    timed = create_detector(name, bodies).detect(motion).seconds
    assert set(timed) <= set(load_detector(name).stages)
    assert {STAGE_LABELS.get(stage, stage) for stage in timed} <= FIELD_STAGES
    assert all(np.sum(seconds) >= 0 for seconds in timed.values())


def test_stress_runs_every_detector_that_tests_triangles():
    """Stress runs all but those whose row says why triangles tell nothing about them (``no_triangles``)."""
    requested = {spec.name for spec in detectors_of(ALL_DETECTORS)}
    assert requested.isdisjoint(name for name in TABLE if TABLE[name].no_triangles)
    assert requested >= {name for name in TABLE if not TABLE[name].no_triangles}


def test_every_engine_module_belongs_to_a_pip_extra():
    """Detector of the table -> the module that it imports; three extras of the package install them."""
    modules = {"mujoco": "mujoco", "rapier": "rapier3d", "bullet": "pybullet", "physx": "ovphysx", "newton": "newton"}
    assert modules == ENGINE_MODULE
    assert modules.keys() == OPTIONAL.keys()
    assert {row.extra for row in OPTIONAL.values()} == {"engines", "physx", "newton"}


@pytest.mark.parametrize("name", TABLE)
def test_written_settings_of_a_row_read_as_the_same(name):
    """Default settings, written as on a command line and read again."""
    settings = asdict(load_detector(name).Settings())
    read = parse_detector(spec_text(name, settings))
    assert read.name == name
    assert load_detector(name).Settings(**read.settings) == load_detector(name).Settings()
