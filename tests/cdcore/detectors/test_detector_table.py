"""Every row of the table of detectors loads on demand, says where it comes from, and keeps its promises."""

import subprocess
import sys
from importlib.metadata import EntryPoint
from time import perf_counter

import numpy as np
import pytest
from support.optional import ENGINE_MODULE, ROWS
from support.shapes import box_mesh, lab_bodies_and_motion

import cdcore.detectors.detector_table as table
from cdcore import Body, create_detector
from cdcore.detectors.detector_table import DETECTORS, OPTIONAL, detector_names, load_detector
from cdcore.detectors.sphere import SphereDetector
from cdcore.errors import InvalidSettingError, MissingEngineError, UnknownDetectorError

TABLE = [*DETECTORS, *OPTIONAL]
BODIES = [Body("a", box_mesh()), Body("b", box_mesh())]


@pytest.mark.parametrize("name", TABLE)
def test_every_row_names_a_class_of_that_name(name):
    assert load_detector(name).name == name


@pytest.mark.parametrize("name", ROWS)
def test_stage_seconds_sum_to_at_most_the_call(name):
    """Seconds that a detector reports for its stages, beside the clock around the call."""
    bodies, motion = lab_bodies_and_motion(frames=3)
    detector, start = create_detector(name, bodies), perf_counter()
    spent = [float(np.sum(stage)) for stage in detector.detect(motion).seconds.values()]
    assert min(spent) >= 0 and 0 < sum(spent) <= perf_counter() - start


def test_unknown_name_is_answered_with_known_names():
    """A name that is close to one of them, spheer, and one that is not, chaos."""
    with pytest.raises(
        UnknownDetectorError, match=r"no detector 'spheer'; did you mean 'sphere'\? There are: .*hybrid"
    ):
        create_detector("spheer", BODIES)
    with pytest.raises(UnknownDetectorError, match=r"no detector 'chaos'; there are: sphere, .*hybrid"):
        create_detector("chaos", BODIES)


def test_detectors_load_without_reading_installed_packages(monkeypatch):
    """Calling ``entry_points``, which lists installed packages, would fail: it is None here."""
    monkeypatch.setattr(table, "entry_points", None)
    assert load_detector("sphere") is load_detector("cdcore.detectors.sphere:SphereDetector") is SphereDetector


OWN_MODULES = {
    "own_engine": "class Detector: pass",
    "own_without_scipy": "import scipy_of_tomorrow",
    "own_with_fault": "1 / 0",
}


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("own_engine:Detektor", r"own_engine has no class 'Detektor'; did you mean own_engine:Detector\?"),
        ("own_engine:Mesh", "own_engine has no class 'Mesh'; it defines: Detector"),
        ("own_engin:Detector", "there is no module 'own_engin' in this folder or this environment"),
        ("own_engine.parts:Detector", "there is no module 'own_engine.parts' in this folder or this environment"),
        ("own_without_scipy:Detector", "own_without_scipy cannot be imported: No module named 'scipy_of_tomorrow'"),
        ("own_with_fault:Detector", "own_with_fault cannot be imported: ZeroDivisionError: division by zero"),
        ("own_engine:Detector", "'own_engine:Detector' is no detector: it defines no Settings, detect, stream.*"),
    ],
)
def test_unloadable_own_detector_is_refused_with_the_reason(name, sentence, monkeypatch, tmp_path):
    """``name``: module and class of a detector of one's own, in the modules of OWN_MODULES; ``sentence``: why not."""
    for module, code in OWN_MODULES.items():
        (tmp_path / f"{module}.py").write_text(code)
        monkeypatch.delitem(sys.modules, module, raising=False)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(UnknownDetectorError, match=f"^{sentence}$"):
        load_detector(name)


def test_an_installed_package_adds_a_row(monkeypatch):
    """A stand-in for an installed package offers the class of ``sphere`` under the name outside."""
    point = EntryPoint("outside", "cdcore.detectors.sphere:SphereDetector", table.ENTRY_POINT_GROUP)

    def answer(group, name=None):
        assert group == table.ENTRY_POINT_GROUP
        return [point] if name in (None, "outside") else []

    monkeypatch.setattr(table, "entry_points", answer)
    assert detector_names()[-1] == "outside"
    assert load_detector("outside") is SphereDetector


@pytest.mark.parametrize(
    ("entry", "why"),
    [
        ("no_such_module:Thing", "there is no module"),
        ("breaks_on_import:X", "boom"),
        ("cdcore.detectors.sphere:Spheer", "has no class"),
    ],
)
def test_failing_package_is_named_and_hides_no_built_in(entry, why, monkeypatch, tmp_path):
    """An installed package offers two broken detectors, one of them called ``sphere``, as one of ours is."""
    (tmp_path / "breaks_on_import.py").write_text("raise ZeroDivisionError('boom')")
    monkeypatch.syspath_prepend(tmp_path)
    points = {name: EntryPoint(name, entry, table.ENTRY_POINT_GROUP) for name in ("broken", "sphere")}
    monkeypatch.setattr(table, "entry_points", lambda group, name: [points[name]])
    with pytest.raises(
        UnknownDetectorError, match=f"detector 'broken' \\({entry}\\) cannot be loaded: .*{why}.*; repair or"
    ):
        load_detector("broken")
    assert load_detector("sphere") is SphereDetector


def test_unknown_settings_are_answered_with_known_settings():
    with pytest.raises(InvalidSettingError, match="'sphere' has no setting 'speed'; it has: sphere"):
        create_detector("sphere", BODIES, speed=3)


@pytest.mark.parametrize("name", OPTIONAL)
def test_missing_engine_error_names_the_pip_command(name, monkeypatch):
    """The message is one sentence in one line."""
    module = ENGINE_MODULE[name]
    monkeypatch.setitem(sys.modules, module, None)
    extra = name if name in ("physx", "newton") else "engines"
    with pytest.raises(
        MissingEngineError, match=rf'^{module} is not installed; pip install "vrlab-replay\[{extra}\]"'
    ) as text:
        create_detector(name, BODIES)
    assert "\n" not in str(text.value) and ". " not in str(text.value)


def test_settings_arrive_and_are_kept():
    assert create_detector("sphere", BODIES, sphere="paper").settings.sphere == "paper"


def test_table_loads_no_engine_before_use():
    """A new process imports the core and names its table: no library of ``engines`` is loaded."""
    engines = {"fcl", "numba", "scipy", "mujoco", "rapier3d", "pybullet", "ovphysx", "newton", "warp"}
    code = f"import sys, cdcore; cdcore.DETECTORS; cdcore.Motion; print({engines} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert done.stdout.strip() == "set()"


@pytest.mark.parametrize(
    ("name", "lacks"),
    [
        ("cdcore:FrameDetector", "look"),
        ("cdcore:Motion", "Settings, detect, stream"),
        ("cdcore:join", "Settings, detect, stream"),
    ],
)
def test_incomplete_detector_class_is_refused_naming_missing_methods(name, lacks):
    """``name``: things of the core that are no detector; ``lacks``: what each would have to define."""
    with pytest.raises(UnknownDetectorError, match=f"'{name}' is no detector: it defines no {lacks}; see"):
        load_detector(name)


@pytest.mark.parametrize("name", TABLE)
def test_every_row_has_sources_purpose_and_limits(name):
    """Different sources of at least four words; ``choose_when`` and ``cannot`` are phrases without a full stop."""
    detector = load_detector(name)
    sources = detector.sources
    assert isinstance(sources, tuple) and sources
    assert all(isinstance(source, str) and len(source.split()) >= 4 for source in sources)
    assert len(set(sources)) == len(sources)
    for labels in (detector.choose_when, detector.cannot):
        assert isinstance(labels, str) and labels == labels.strip() and len(labels.split()) >= 2
        assert "\n" not in labels and not labels.endswith(".")
    assert detector.__doc__
