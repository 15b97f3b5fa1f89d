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

POSITIONS = [3, 3, 0.9, 0.9, 3, 3, 3, 0.9, 3, 3]
"""Metres between two unit cubes, a frame each: in contact in frames 2, 3 and 7."""

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
def audited(tmp_path_factory):
    """The folder of a session and of a run that audited a detector of the table."""
    folder = tmp_path_factory.mktemp("audited")
    write_session(unit_cubes_on_x({"a": [0] * 10, "b": POSITIONS}), folder / "s.mcap")
    run(folder / "s.mcap", detectors="slow=discrete[rate_hz=25]", out=folder / "run", picture=False)
    return folder


@pytest.fixture
def folder(audited, tmp_path, monkeypatch):
    """A copy of that run, and a module beside it that tells when it is imported."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path, str(tmp_path)])
    shutil.copytree(audited, tmp_path, dirs_exist_ok=True)
    (tmp_path / "sent_along.py").write_text(SENT_ALONG)
    yield tmp_path / "run"
    sys.modules.pop("sent_along", None)


@pytest.mark.parametrize("name", ["sent_along:Blind", pytest.param("os:system", marks=pytest.mark.slow)])
def test_a_class_named_by_a_folder_alone_is_never_imported(folder, name, capsys):
    """``shrink`` needs the class: it stops and names the option that allows it. The others need no detector."""
    tamper(folder, "detectors", slow={"name": name, "settings": {}})
    for command, code in (
        (["shrink", "run", "--miss", "1"], 1),
        (["diff", "run", "run"], 0),
        (["share", "run", "-o", "sent", "--anyway"], 0),
    ):
        assert main(command) == code, command
        message = " ".join(capsys.readouterr().err.split())
        assert (f"--detector slow={name}" in message) == (code == 1), command
        assert "should not have happened" not in message, command
    assert not (folder.parent / "sent_along.imported").exists() and "sent_along" not in sys.modules


@pytest.mark.slow
@pytest.mark.parametrize("key", ["containment", 'x"""\nimport pathlib\npathlib.Path("ran").touch()\n"""'])
def test_folder_settings_never_become_lines_of_the_written_test(folder, key, monkeypatch):
    """A setting, or its name, ends a text and goes on as code that would make the file ``ran``."""
    attack = 'yes"""\nimport pathlib\npathlib.Path("ran").touch()\n"""'
    tamper(folder, "detectors", slow={"settings": {"rate_hz": 25, key: attack}})
    main(["shrink", "run", "--miss", "1", "-o", "case"])
    monkeypatch.chdir(folder.parent)
    for file in folder.parent.glob("case/*.py"):
        exec(compile(file.read_text(), str(file), "exec"), {"__file__": str(file), "__name__": "case"})
    assert not (folder.parent / "ran").exists()


@pytest.mark.parametrize(("piece", "key", "value"), [("window", "end", 0), ("session", "frames", 11)])
def test_folder_with_frames_unlike_its_recording_is_refused(folder, piece, key, value, capsys):
    """The summary states a window that ends at 0 s, or a frame more than the recording has."""
    tamper(folder, piece, **{key: value})
    assert main(["shrink", "run", "--miss", "1", "-o", "case"]) == 1
    assert "other frames or bodies than its recording" in " ".join(capsys.readouterr().err.split())


def test_shrink_imports_an_own_detector_only_when_named(folder, capsys):
    """The run was made here with the class sent_along:Blind, which reports nothing."""
    run("s.mcap", detectors="mine=sent_along:Blind", out="own", picture=False)
    assert main(["shrink", "own", "--miss", "1", "-o", "case"]) == 1
    assert "--detector mine=sent_along:Blind" in " ".join(capsys.readouterr().err.split())
    assert main(["shrink", "own", "--miss", "1", "--detector", "mine=sent_along:Blind", "-o", "case"]) == 0
    assert json.loads((folder.parent / "case" / "case.json").read_text())["detector"] == "sent_along:Blind"
