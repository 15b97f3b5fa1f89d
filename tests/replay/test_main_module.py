"""``python -m replay`` in a folder with files that are named like modules of the environment."""

import subprocess
import sys

import pytest
from support.processes import environment
from support.small_worlds import unit_cubes_on_x

from sessions import write_session

FOREIGN = 'open("ran", "w").write(__name__)\nraise SystemExit("this is not the tool")\n'


@pytest.mark.parametrize("options", [(), ("-P",)], ids=["plain", "-P"])
def test_the_current_folder_does_not_come_before_the_environment(tmp_path, options):
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
