"""Every row of the table of detectors loads on demand, says where it comes from, and keeps its promises."""

import subprocess
import sys
from importlib.metadata import EntryPoint

import numpy as np
import pytest
from support.optional import ENGINE_MODULE
from support.shapes import box_mesh

import cdcore.detectors.detector_table as table
from cdcore import Body, TriangleMesh, create_detector
from cdcore.detectors.detector_table import DETECTORS, OPTIONAL, detector_names, load_detector
from cdcore.detectors.sphere import SphereDetector
from cdcore.errors import InvalidMeshError, InvalidSettingError, MissingEngineError, UnknownDetectorError

TABLE = [*DETECTORS, *OPTIONAL]
"""Names of all detectors of our own and of the engines of others."""
BODIES = [Body("a", box_mesh()), Body("b", box_mesh())]


def test_unknown_name_is_answered_with_known_names():
    """A name close to one of them, spheer, and one close to none, chaos."""
    with pytest.raises(
        UnknownDetectorError, match=r"no detector 'spheer'; did you mean 'sphere'\? There are: .*hybrid"
    ):
        create_detector("spheer", BODIES)
    with pytest.raises(UnknownDetectorError, match=r"no detector 'chaos'; there are: sphere, .*hybrid"):
        create_detector("chaos", BODIES)


@pytest.mark.parametrize("name", ["sphere", "cdcore.detectors.sphere:SphereDetector"], ids=["name", "module and class"])
def test_detectors_load_without_reading_installed_packages(name, monkeypatch):
    """``entry_points`` would list installed packages, which takes time; it is None here, so that a call fails."""
    monkeypatch.setattr(table, "entry_points", None)
    assert load_detector(name) is SphereDetector


OWN_MODULES = {
    "own_engine": "class Detector: pass",
    "own_without_scipy": "import scipy_of_tomorrow",
    "own_with_fault": "1 / 0",
}
"""Name -> code of a module that a user wrote."""


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        pytest.param(
            "own_engine:Detektor",
            r"own_engine has no class 'Detektor'; did you mean own_engine:Detector\?",
            id="class misspelt",
        ),
        pytest.param("own_engine:Mesh", "own_engine has no class 'Mesh'; it defines: Detector", id="another class"),
        pytest.param(
            "own_engin:Detector",
            "there is no module 'own_engin' in this folder or this environment",
            id="module misspelt",
        ),
        pytest.param(
            "own_engine.parts:Detector",
            "there is no module 'own_engine.parts' in this folder or this environment",
            id="no such submodule",
        ),
        pytest.param(
            "own_without_scipy:Detector",
            "own_without_scipy cannot be imported: No module named 'scipy_of_tomorrow'",
            id="imports what is not installed",
        ),
        pytest.param(
            "own_with_fault:Detector",
            "own_with_fault cannot be imported: ZeroDivisionError: division by zero",
            id="raises an error",
        ),
        pytest.param(
            "own_engine:Detector",
            "'own_engine:Detector' is no detector: it defines no Settings, detect, stream.*",
            id="class without methods",
        ),
    ],
)
def test_unloadable_own_detector_is_refused_with_the_reason(name, sentence, monkeypatch, tmp_path):
    """A detector of one's own is named ``module:Class``; OWN_MODULES are written to a folder of the import path."""
    for module, code in OWN_MODULES.items():
        (tmp_path / f"{module}.py").write_text(code)
        monkeypatch.delitem(sys.modules, module, raising=False)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(UnknownDetectorError, match=f"^{sentence}$"):
        load_detector(name)


def test_an_installed_package_adds_a_row(monkeypatch):
    """A stand-in for ``entry_points`` has a package that offers the class of ``sphere`` under the name "outside"."""
    point = EntryPoint("outside", "cdcore.detectors.sphere:SphereDetector", table.ENTRY_POINT_GROUP)

    def entry_points(group, name=None):
        assert group == table.ENTRY_POINT_GROUP
        return [point] if name in (None, "outside") else []

    monkeypatch.setattr(table, "entry_points", entry_points)
    assert detector_names()[-1] == "outside"
    assert load_detector("outside") is SphereDetector


@pytest.mark.parametrize(
    ("entry", "reason"),
    [
        pytest.param("no_such_module:Thing", "there is no module", id="no module"),
        pytest.param("breaks_on_import:X", "boom", id="raises an error"),
        pytest.param("cdcore.detectors.sphere:Spheer", "has no class", id="no class"),
    ],
)
def test_detector_of_a_failing_package_is_refused_by_name(entry, reason, monkeypatch, tmp_path):
    """A stand-in for ``entry_points`` has a package that offers a detector "broken", which cannot be imported."""
    (tmp_path / "breaks_on_import.py").write_text("raise ZeroDivisionError('boom')")
    monkeypatch.syspath_prepend(tmp_path)
    point = EntryPoint("broken", entry, table.ENTRY_POINT_GROUP)
    monkeypatch.setattr(table, "entry_points", lambda group, name: [point])
    with pytest.raises(
        UnknownDetectorError, match=f"detector 'broken' \\({entry}\\) cannot be loaded: .*{reason}.*; repair or"
    ):
        load_detector("broken")


def test_failing_package_hides_no_built_in_detector(monkeypatch):
    """An installed package offers a broken detector "sphere", as one of ours is called."""
    point = EntryPoint("sphere", "no_such_module:Thing", table.ENTRY_POINT_GROUP)
    monkeypatch.setattr(table, "entry_points", lambda group, name: [point])
    assert load_detector("sphere") is SphereDetector


def test_unknown_settings_are_answered_with_known_settings():
    """``sphere`` has a single setting, which is called sphere too."""
    with pytest.raises(InvalidSettingError, match="'sphere' has no setting 'speed'; it has: sphere"):
        create_detector("sphere", BODIES, speed=3)


@pytest.mark.parametrize("name", OPTIONAL)
def test_missing_engine_error_names_the_pip_command(name, monkeypatch):
    """The module of an engine cannot be imported; the message is one sentence in one line.

    PhysX and Newton are extras of their own, all others the extra "engines".
    """
    module = ENGINE_MODULE[name]
    monkeypatch.setitem(sys.modules, module, None)
    extra = name if name in ("physx", "newton") else "engines"
    with pytest.raises(
        MissingEngineError, match=rf'^{module} is not installed; pip install "vrlab-replay\[{extra}\]"'
    ) as error:
        create_detector(name, BODIES)
    message = str(error.value)
    assert "\n" not in message
    assert ". " not in message


def test_settings_arrive_and_are_kept():
    """The setting "paper" of ``sphere``, which by default is another."""
    assert create_detector("sphere", BODIES, sphere="paper").settings.sphere == "paper"


def test_table_loads_no_engine_before_use():
    """A new process imports the core and uses its table: no library of ``engines`` is loaded."""
    engines = {"fcl", "numba", "scipy", "mujoco", "rapier3d", "pybullet", "ovphysx", "newton", "warp"}
    code = f"import sys, cdcore; cdcore.DETECTORS; cdcore.Motion; print({engines} & set(sys.modules))"
    process = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert process.stdout.strip() == "set()"


@pytest.mark.parametrize(
    ("name", "missing"),
    [
        pytest.param("cdcore:FrameDetector", "look", id="abstract class"),
        pytest.param("cdcore:Motion", "Settings, detect, stream", id="another class"),
        pytest.param("cdcore:join", "Settings, detect, stream", id="function"),
    ],
)
def test_incomplete_detector_class_is_refused_naming_missing_methods(name, missing):
    """``name``: things of the core that are no detector; ``missing``: what each would have to define."""
    with pytest.raises(UnknownDetectorError, match=f"'{name}' is no detector: it defines no {missing}; see"):
        load_detector(name)


@pytest.mark.parametrize("name", TABLE)
def test_every_row_names_and_describes_its_class(name):
    """The class that a row loads has the name of the row, a docstring, sources, its purpose and its limits.

    Sources are a tuple of different texts, each of at least four words. Purpose and limits are phrases in one line,
    without a full stop, of at least two words.
    """
    detector = load_detector(name)
    assert detector.name == name
    assert detector.__doc__
    sources = detector.sources
    assert isinstance(sources, tuple)
    assert sources
    assert all(len(source.split()) >= 4 for source in sources)
    assert len(set(sources)) == len(sources)
    for phrase in (detector.choose_when, detector.cannot):
        assert phrase == phrase.strip(), phrase
        assert len(phrase.split()) >= 2, phrase
        assert "\n" not in phrase, phrase
        assert not phrase.endswith("."), phrase


@pytest.mark.parametrize("name", ["static", "discrete", "hybrid", "qaco", "hybrid-qaco", "collider"])
def test_bodies_beyond_nature_are_refused(name):
    """FCL, searches and hulls compare squares of lengths, which doubles do not hold for a cube of 2^600 m.

    Its corners are half of 2^600 = 4.1e180 m from its middle on each axis: 2.1e180 m.
    """
    cube = box_mesh()
    huge = Body("star", TriangleMesh(np.ldexp(cube.vertices, 600), cube.faces))
    with pytest.raises(InvalidMeshError, match=r"body 'star' reaches 2.1e\+180 m .*: give its vertices in metres"):
        create_detector(name, [BODIES[0], huge])
