"""Every row of the table of detectors says all that the tool must know of it."""

from dataclasses import asdict
from time import perf_counter

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


def problems_of(name, row):
    """Words for what a row of the table lacks or contradicts, of the detector of this name."""
    detector = load_detector(name)
    problems = []
    if not row.label or row.label == name:
        problems.append("a label")
    if row.contact_offset and not hasattr(settings_of(name, {}), row.contact_offset):
        problems.append(f"the setting {row.contact_offset}")
    if bool(row.contact_offset) != (detector.contact_reach is not load_detector("exact").contact_reach):
        problems.append("a contact offset with its reach")
    if issubclass(detector, EngineDetector) != bool(row.engine and row.extra):
        problems.append("the engine and its extra")
    if row.sampled and not issubclass(detector.Settings, RateSettings):
        problems.append("a rate")
    if not getattr(detector, "stages", ()):
        problems.append("its stages")
    return problems


def test_every_row_of_the_detector_table_is_complete():
    """A row has a label other than its name; where its detector has them, contact offset, engine and rate fit it."""
    problems = {name: problems_of(name, row) for name, row in TABLE.items()}
    assert problems
    assert {name: texts for name, texts in problems.items() if texts} == {}


def test_check_of_rows_names_what_a_bare_row_lacks():
    """The check of the test above can fail: a row of nothing but the place of its detector lacks a label.

    Where the detector has a contact offset or an engine, the bare row lacks that too.
    """
    for name, row in TABLE.items():
        bare = DetectorRow(entry=row.entry, label="")
        lacking = {"a label"}
        lacking |= {"a contact offset with its reach"} if row.contact_offset else set()
        lacking |= {"the engine and its extra"} if row.engine else set()
        assert set(problems_of(name, bare)) == lacking, name


def test_labels_of_rows_differ():
    """No two detectors of the table have one label."""
    labels = [row.label for row in TABLE.values()]
    assert len(set(labels)) == len(labels)


def test_detector_from_outside_the_table_is_labelled_by_its_name():
    """The name of a user's own detector is its module and class."""
    assert detector_label("outside:Engine", {}) == "outside:Engine"


@pytest.mark.parametrize("name", [name for name in TABLE if TABLE[name].complete_with is not None])
def test_settings_that_make_a_detector_complete_are_accepted(name):
    """With ``complete_with`` a detector misses no contact at a frame; with another value of any of them it may.

    The detector takes these settings, and advice counts it as complete with them alone.
    """
    complete_with = dict(TABLE[name].complete_with)
    settings_of(name, complete_with)
    assert Setting(spec_text(name, complete_with), name, complete_with).complete
    for key in complete_with:
        assert not Setting("other", name, complete_with | {key: "no such value"}).complete, key


@pytest.mark.parametrize("name", ROWS)
def test_contact_offset_of_5_cm_widens_the_reach(name):
    """The reach is the gap, in metres, up to which a detector may report contact; without an offset it is 0."""
    first_pair, row, (bodies, _) = 0, detector_row(name), lab_bodies_and_motion(frames=2)
    reach = create_detector(name, bodies).contact_reach(first_pair)
    if row.contact_offset:
        assert create_detector(name, bodies, **{row.contact_offset: 0.05}).contact_reach(first_pair) > reach
    else:
        assert reach == 0.0


@pytest.mark.parametrize("name", [name for name in TABLE if TABLE[name].contact_offset])
def test_contact_offset_of_0_narrows_the_reach_or_is_refused(name):
    """A row says whether its detector works without an offset (``takes_no_offset``)."""
    row = detector_row(name)
    if not row.takes_no_offset:
        with pytest.raises(InvalidSettingError, match=rf"{row.contact_offset}=0\.0 is not allowed"):
            settings_of(name, {row.contact_offset: 0.0})
        return
    if row.engine:
        pytest.importorskip(row.engine)
    first_pair, (bodies, _) = 0, lab_bodies_and_motion(frames=2)
    usual_reach = create_detector(name, bodies).contact_reach(first_pair)
    assert create_detector(name, bodies, **{row.contact_offset: 0.0}).contact_reach(first_pair) <= usual_reach


@pytest.mark.parametrize("name", ROWS)
def test_detector_times_only_its_declared_stages(name):
    """The stages that a detector times are those that its class declares, with seconds of 0 or more.

    Their sum is at most that of the clock around the call. Screens translate its own names into words of the field
    (STAGE_LABELS): those of FIELD_STAGES.
    """
    bodies, motion = lab_bodies_and_motion(frames=4)
    detector, start = create_detector(name, bodies), perf_counter()
    seconds_of_stage = detector.detect(motion).seconds
    elapsed = perf_counter() - start
    assert 0 < sum(float(np.sum(seconds)) for seconds in seconds_of_stage.values()) <= elapsed
    assert seconds_of_stage.keys() <= set(load_detector(name).stages)
    assert {STAGE_LABELS.get(stage, stage) for stage in seconds_of_stage} <= FIELD_STAGES
    assert all(np.sum(seconds) >= 0 for seconds in seconds_of_stage.values())


def test_stress_runs_every_detector_that_tests_triangles():
    """All detectors but those whose row says why pairs of triangles, which ``stress`` draws, tell nothing of them."""
    tested = {spec.name for spec in detectors_of(ALL_DETECTORS)}
    assert tested.isdisjoint(name for name in TABLE if TABLE[name].no_triangles)
    assert tested >= {name for name in TABLE if not TABLE[name].no_triangles}


def test_every_engine_module_belongs_to_a_pip_extra():
    """Detector of the table -> the module that it imports; three extras of the package install them."""
    modules = {"mujoco": "mujoco", "rapier": "rapier3d", "bullet": "pybullet", "physx": "ovphysx", "newton": "newton"}
    assert modules == ENGINE_MODULE
    assert modules.keys() == OPTIONAL.keys()
    assert {row.extra for row in OPTIONAL.values()} == {"engines", "physx", "newton"}


def test_written_settings_of_a_row_read_as_the_same():
    """The default settings of each detector are written as on a command line, and read as they were."""
    for name in TABLE:
        settings = load_detector(name).Settings()
        read = parse_detector(spec_text(name, asdict(settings)))
        assert read.name == name
        assert load_detector(name).Settings(**read.settings) == settings, name
