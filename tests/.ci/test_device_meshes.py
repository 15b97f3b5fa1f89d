"""The script that makes the shipped meshes of hands, wand and headset makes those that are shipped."""

import runpy
from pathlib import Path

import pytest

from sessions.glassware import devices

SCRIPT = Path(__file__).resolve().parents[2] / ".ci" / "device_meshes.py"


@pytest.mark.slow
def test_the_shipped_meshes_are_those_that_the_script_makes(tmp_path, monkeypatch):
    """The script writes its meshes into another folder: the 16 that are shipped are there, byte by byte."""
    monkeypatch.setattr(devices, "FOLDER", tmp_path)
    runpy.run_path(str(SCRIPT), run_name="__main__")
    shipped = sorted(Path(devices.__file__).with_name("device_meshes").glob("*.glb"))
    assert len(shipped) == 16
    for file in shipped:
        assert (tmp_path / file.name).read_bytes() == file.read_bytes(), file.name
