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


@pytest.mark.parametrize("present", ["0.22.1", "0.42.0", None])
def test_other_rerun_version_is_named_first_and_only_for_pictures(present, tmp_path, monkeypatch, capsys):
    """Nothing is computed before the command ends; without a picture Rerun is not needed."""
    real = importlib.metadata.version

    def version(name):
        if name == "rerun-sdk" and present is None:
            raise importlib.metadata.PackageNotFoundError(name)
        return present if name == "rerun-sdk" else real(name)

    for name in [name for name in sys.modules if name.startswith("replay.show.rerun_log")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setattr(importlib.metadata, "version", version)
    write_session(unit_cubes_on_x({"a": [0] * 4, "b": [3, 3, 0.9, 3]}), tmp_path / "s.mcap")
    text = ["run", str(tmp_path / "s.mcap"), "--detectors", "hybrid", "-o", str(tmp_path / "run")]
    assert main(text) == 1
    output = capsys.readouterr().err
    named = f"rerun-sdk {present} is installed" if present else "rerun-sdk is not installed"
    assert named in output and f"pictures need {RERUN_VERSION}" in output and "--no-picture" in output
    assert not (tmp_path / "run").exists()
    assert main([*text, "--no-picture"]) == 0


def test_named_version_is_the_required_version():
    """Required by pyproject.toml."""
    assert [item for item in PROJECT["dependencies"] if item.startswith(f"rerun-sdk>={RERUN_VERSION},")]
