"""Another Rerun than the one the picture is written for is one sentence, said before the work."""

import importlib.metadata
import sys
import tomllib
from pathlib import Path

import pytest
from support.small_worlds import unit_cubes_on_x

from replay.cli.main import main
from replay.show.rerun_log import RERUN_VERSION
from sessions import write_session

PROJECT = tomllib.loads((Path(__file__).resolve().parents[4] / "pyproject.toml").read_text("utf-8"))["project"]


@pytest.fixture
def install_rerun(monkeypatch):
    """Pretends that another version of Rerun is installed (None: none), before the tool imports it."""
    true_version = importlib.metadata.version

    def pretend(installed):
        def version(name):
            if name != "rerun-sdk":
                return true_version(name)
            if installed is None:
                raise importlib.metadata.PackageNotFoundError(name)
            return installed

        for name in [name for name in sys.modules if name.startswith("replay.show.rerun_log")]:
            monkeypatch.delitem(sys.modules, name)
        monkeypatch.setattr(importlib.metadata, "version", version)

    return pretend


@pytest.fixture
def run_command(tmp_path):
    """Arguments of the command that runs a session of two cubes into the folder ``run``."""
    write_session(unit_cubes_on_x({"a": [0] * 4, "b": [3, 3, 0.9, 3]}), tmp_path / "s.mcap")
    return ["run", str(tmp_path / "s.mcap"), "--detectors", "hybrid", "-o", str(tmp_path / "run")]


@pytest.mark.parametrize(
    ("installed", "sentence"),
    [
        pytest.param("0.22.1", "rerun-sdk 0.22.1 is installed", id="older"),
        pytest.param("0.42.0", "rerun-sdk 0.42.0 is installed", id="newer"),
        pytest.param(None, "rerun-sdk is not installed", id="none"),
    ],
)
def test_other_rerun_version_is_named_before_a_run(installed, sentence, install_rerun, run_command, tmp_path, capsys):
    """``replay run`` with a picture exits with 1 and a sentence before it computes: no run folder is begun.

    The sentence names the version that pictures need, and the option ``--no-picture``.
    """
    install_rerun(installed)
    assert main(run_command) == 1
    printed = capsys.readouterr().err
    assert sentence in printed
    assert f"pictures need {RERUN_VERSION}" in printed
    assert "--no-picture" in printed
    assert not (tmp_path / "run").exists()


def test_run_without_a_picture_needs_no_rerun(install_rerun, run_command, tmp_path):
    """With ``--no-picture`` a session is run and written where Rerun is not installed."""
    install_rerun(None)
    assert main([*run_command, "--no-picture"]) == 0
    assert (tmp_path / "run" / "summary.json").exists()


def test_named_version_is_the_required_version():
    """``RERUN_VERSION`` in the code is the lowest version that pyproject.toml requires."""
    (requirement,) = [item for item in PROJECT["dependencies"] if item.startswith("rerun-sdk")]
    assert requirement.startswith(f"rerun-sdk>={RERUN_VERSION},")
