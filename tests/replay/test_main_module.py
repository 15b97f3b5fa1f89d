"""``python -m replay`` in a folder with files that are named like modules of the environment."""

import runpy
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from support.processes import environment
from support.small_worlds import unit_cubes_on_x

import replay
from sessions import write_session

FOREIGN = 'open("ran", "w").write(__name__)\nraise SystemExit("this is not the tool")\n'
"""Text of a module that leaves the file ``ran`` and ends the program, if anything imports it."""


@pytest.mark.slow
@pytest.mark.parametrize("options", [(), ("-P",)], ids=["plain", "-P"])
def test_the_current_folder_does_not_come_before_the_environment(tmp_path, options):
    """Files of the current folder are called like modules that the tool imports, or parts of it; none of them runs.

    ``replay info`` prints the 12 frames of the session there. ``options``: of Python, -P for a safe search path.
    """
    write_session(unit_cubes_on_x({"a": [0] * 12, "b": [3, 3, 0.9] * 4}), tmp_path / "s.mcap")
    for name in ("numpy.py", "mcap.py", "rich.py", "zstandard.py"):
        (tmp_path / name).write_text(FOREIGN)
    for name in ("sessions", "cdcore"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text(FOREIGN)
    ended = subprocess.run(
        [sys.executable, *options, "-m", "replay", "info", "s.mcap"],
        cwd=tmp_path,
        env={**environment(), "PYTHONPATH": ""},
        capture_output=True,
        text=True,
    )
    assert (ended.returncode, ended.stderr) == (0, "")
    assert "12" in ended.stdout
    assert not (tmp_path / "ran").exists()


PACKAGES = Path(replay.__file__).parents[1]
"""The folder that holds the packages themselves."""


@pytest.mark.parametrize(
    ("current", "first", "is_safe", "stays"),
    [
        pytest.param("work", "work", False, False, id="the current folder by its path"),
        pytest.param("work", "", False, False, id="the current folder"),
        pytest.param("work", "work", True, True, id="the current folder, which -P has not put there"),
        pytest.param("work", "other", False, True, id="another folder"),
        pytest.param(PACKAGES, "", False, True, id="the current folder, which has the packages"),
    ],
)
def test_only_a_foreign_current_folder_leaves_the_search_path(tmp_path, monkeypatch, current, first, is_safe, stays):
    """``python -m replay`` in the folder ``current``, where ``first`` is the first entry of the search path.

    An empty entry means the current folder. ``is_safe``: whether Python has the option -P; ``stays``: whether the entry
    is still the first one afterwards.
    """
    (tmp_path / "work").mkdir()
    entry = str(tmp_path / first) if first else ""
    monkeypatch.chdir(tmp_path / current)
    monkeypatch.setattr(sys, "path", [entry, *sys.path])
    flags = {name: getattr(sys.flags, name) for name in dir(sys.flags)} | {"safe_path": is_safe}
    monkeypatch.setattr(sys, "flags", SimpleNamespace(**flags))
    monkeypatch.setattr("replay.cli.main.main", lambda: 0)
    with pytest.raises(SystemExit, match=r"^0$"):
        runpy.run_module("replay", run_name="__main__")
    assert (sys.path[0] == entry) == stays
