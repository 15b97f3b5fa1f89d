"""A run folder that somebody else sent is data: nothing in it is imported, and nothing in it becomes code."""

import json
import shutil
import sys

import pytest
from support.report_states import tamper
from support.small_worlds import unit_cubes_on_x

from replay import run
from replay.cli.main import main
from sessions import write_session

GAPS = [3, 3, 0.9, 0.9, 3, 3, 3, 0.9, 3, 3]
"""Metres between the middles of two cubes of 1 m, frame by frame of 10 ms: in contact in frames 2, 3 and 7."""

SENT_ALONG = """
from pathlib import Path
from cdcore import FrameDetector, Verdict

Path(__file__).with_suffix(".imported").touch()


class Blind(FrameDetector):
    name = "blind"

    def look(self, rotations, translations):
        return [Verdict.CLEAR] * len(self.pairs)
"""
"""The source of sent_along.py: a detector, and a line that leaves sent_along.imported where it is imported."""


@pytest.fixture(scope="module")
def audited_folder(tmp_path_factory):
    """A folder with a session, s.mcap, and a run whose detector slow samples every fourth frame and misses contacts."""
    folder = tmp_path_factory.mktemp("audited")
    write_session(unit_cubes_on_x({"a": [0] * 10, "b": GAPS}), folder / "s.mcap")
    run(folder / "s.mcap", detectors="slow=discrete[rate_hz=25]", out=folder / "run", picture=False)
    return folder


@pytest.fixture
def received_run(audited_folder, tmp_path, monkeypatch):
    """A copy of the run, and beside it a module that leaves sent_along.imported where it is imported."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path, str(tmp_path)])
    shutil.copytree(audited_folder, tmp_path, dirs_exist_ok=True)
    (tmp_path / "sent_along.py").write_text(SENT_ALONG)
    yield tmp_path / "run"
    sys.modules.pop("sent_along", None)


@pytest.mark.parametrize("name", ["sent_along:Blind", pytest.param("os:system", marks=pytest.mark.slow)])
def test_a_class_named_by_a_folder_alone_is_never_imported(received_run, name, capsys):
    """A run folder says that its detector is ``module:Class``, of a module that came with it, or of Python's ``os``.

    ``shrink`` needs the class: it stops and names the option that allows it. ``diff`` and ``share`` need no detector.
    The module that came along would write the file sent_along.imported when it is imported.
    """
    tamper(received_run, "detectors", slow={"name": name, "settings": {}})
    assert main(["shrink", "run", "--miss", "1"]) == 1
    message = " ".join(capsys.readouterr().err.split())
    assert f"--detector slow={name}" in message and "should not have happened" not in message
    for command in (["diff", "run", "run"], ["share", "run", "-o", "sent", "--anyway"]):
        assert main(command) == 0, command
        message = " ".join(capsys.readouterr().err.split())
        assert "--detector" not in message and "should not have happened" not in message, command
    assert not (received_run.parent / "sent_along.imported").exists()
    assert "sent_along" not in sys.modules


@pytest.mark.slow
@pytest.mark.parametrize(
    ("key", "code"),
    [
        pytest.param("sampling_offset_s", 0, id="setting that the test leaves out"),
        pytest.param("containment", 1, id="setting of the detector"),
        pytest.param('x"""\nimport pathlib\npathlib.Path("ran").touch()\n"""', 1, id="name of a setting"),
    ],
)
def test_folder_settings_never_become_lines_of_the_written_test(received_run, key, code, monkeypatch):
    """A setting, or its name, ends a text and goes on as code that would make the file ``ran``.

    ``shrink`` writes a test into the folder case (0), which is executed here, or fails (1), as there is no such
    detector, and writes none. It leaves out when samples begin.
    """
    attack = 'yes"""\nimport pathlib\npathlib.Path("ran").touch()\n"""'
    tamper(received_run, "detectors", slow={"settings": {"rate_hz": 25, key: attack}})
    assert main(["shrink", "run", "--miss", "1", "-o", "case"]) == code
    assert (received_run.parent / "case" / "test_case.py").is_file() == (code == 0)
    monkeypatch.chdir(received_run.parent)
    for file in received_run.parent.glob("case/*.py"):
        exec(compile(file.read_text(), str(file), "exec"), {"__file__": str(file), "__name__": "case"})
    assert not (received_run.parent / "ran").exists()


@pytest.mark.parametrize(
    ("section", "changes"),
    [("window", {"end": 0}), ("session", {"frames": 11})],
    ids=["window that ends at 0 s", "a frame more than the ten recorded"],
)
def test_folder_with_frames_unlike_its_recording_is_refused(received_run, section, changes, capsys):
    """The summary of a run of ten frames says something else of them than its recording: it cannot be repeated."""
    tamper(received_run, section, **changes)
    assert main(["shrink", "run", "--miss", "1", "-o", "case"]) == 1
    assert "other frames or bodies than its recording" in " ".join(capsys.readouterr().err.split())


def test_shrink_imports_an_own_detector_only_when_named(received_run, capsys):
    """A run was made here with the class sent_along:Blind, which reports nothing and so misses the first contact."""
    run("s.mcap", detectors="mine=sent_along:Blind", out="own", picture=False)
    assert main(["shrink", "own", "--miss", "1", "-o", "case"]) == 1
    assert "--detector mine=sent_along:Blind" in " ".join(capsys.readouterr().err.split())
    assert main(["shrink", "own", "--miss", "1", "--detector", "mine=sent_along:Blind", "-o", "case"]) == 0
    case = json.loads((received_run.parent / "case" / "case.json").read_text())
    assert case["detector"] == "sent_along:Blind"


@pytest.mark.parametrize(
    ("detector", "sentence"),
    [
        pytest.param({"settings": {"rate_hz": -1}}, "rate_hz=-1 is not allowed", id="value out of range"),
        pytest.param({"settings": {"rate": 25}}, "'discrete' has no setting 'rate'", id="unknown setting"),
        pytest.param({"name": "discreet"}, "no detector 'discreet'; did you mean", id="unknown detector"),
        pytest.param({"name": "newton", "settings": {}}, "newton is not installed; pip install", id="missing extra"),
        pytest.param(
            {"name": "collider", "settings": {"shape": "compound"}}, "slow tests convex pieces", id="convex pieces"
        ),
    ],
)
def test_detector_that_cannot_be_made_is_refused_with_the_reason(received_run, monkeypatch, detector, sentence, capsys):
    """A run folder says that its detector is another, or has other settings; the extra newton is not installed."""
    monkeypatch.setitem(sys.modules, "newton", None)
    tamper(received_run, "detectors", slow=detector)
    assert main(["shrink", "run", "--miss", "1", "-o", "case"]) == 1
    message = " ".join(capsys.readouterr().err.split())
    assert sentence in message and "clock" not in message


def test_own_detector_that_fails_again_is_not_called_right(received_run, monkeypatch, capsys):
    """The class raised no exception in the run, and raises one when ``shrink`` runs it on the same frames."""
    run("s.mcap", detectors="mine=sent_along:Blind", out="own", picture=False)
    monkeypatch.setattr(sys.modules["sent_along"].Blind, "look", lambda *_: 1 / 0)
    assert main(["shrink", "own", "--miss", "1", "--detector", "mine=sent_along:Blind", "-o", "case"]) == 1
    message = " ".join(capsys.readouterr().err.split())
    assert "ZeroDivisionError" in message and "clock" not in message
