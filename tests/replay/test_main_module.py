"""``python -m replay`` in a folder with files that are named like modules of the environment."""

import runpy
import subprocess
import sys
from pathlib import Path

import pytest
from support.processes import environment
from support.small_worlds import unit_cubes_on_x

import replay
from sessions import write_session

FOREIGN = 'open("ran", "w").write(__name__)\nraise SystemExit("this is not the tool")\n'


@pytest.mark.slow
@pytest.mark.parametrize("options", [(), ("-P",)], ids=["plain", "-P"])
def test_the_current_folder_does_not_come_before_the_environment(tmp_path, options):
    """Files of the folder are called like modules that the tool imports; each would leave the file ``ran``."""
    write_session(unit_cubes_on_x({"a": [0] * 12, "b": [3, 3, 0.9] * 4}), tmp_path / "s.mcap")
    for name in ("numpy.py", "mcap.py", "rich.py", "zstandard.py"):
        (tmp_path / name).write_text(FOREIGN)
    for name in ("sessions", "cdcore"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text(FOREIGN)
    done = subprocess.run(
        [sys.executable, *options, "-m", "replay", "info", "s.mcap"],
        cwd=tmp_path,
        env={**environment(), "PYTHONPATH": ""},
        capture_output=True,
        text=True,
    )
    assert (done.returncode, done.stderr) == (0, "") and "12" in done.stdout
    assert not (tmp_path / "ran").exists()


PACKAGES = Path(replay.__file__).parents[1]
"""The folder that holds the packages themselves."""


@pytest.mark.parametrize(
    ("current", "first", "stays"),
    [("work", "work", False), ("work", "", False), ("work", "other", True), (PACKAGES, "", True)],
)
def test_only_a_foreign_current_folder_leaves_the_search_path(tmp_path, monkeypatch, current, first, stays):
    """``first`` is the first entry of the search path; an empty one means the current folder."""
    (tmp_path / "work").mkdir()
    entry = str(tmp_path / first) if first else ""
    monkeypatch.chdir(tmp_path / current)
    monkeypatch.setattr(sys, "path", [entry, *sys.path])
    monkeypatch.setattr("replay.cli.main.main", lambda: 0)
    with pytest.raises(SystemExit):
        runpy.run_module("replay", run_name="__main__")
    assert (sys.path[0] == entry) == stays
