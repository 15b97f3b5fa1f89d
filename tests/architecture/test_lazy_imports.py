"""Asking for help costs nothing: no numpy, no compiler, no pictures (``tests/bench`` times it)."""

import subprocess
import sys

import pytest

HEAVY = {
    "numpy", "scipy", "numba", "fcl", "trimesh", "rerun", "pyarrow", "rich", "matplotlib", "mcap", "google.protobuf",
    "jinja2",
}  # fmt: skip
"""Modules that take a tenth of a second or more to import, or load others that do."""


def loaded_by(code):
    """Names of the modules that a new process has loaded after this code."""
    program = f"import sys\n{code}\nprint('\\n'.join(sys.modules))"
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    return set(ended.stdout.split())


HELP = """
import contextlib, io
from replay.cli.main import main
with contextlib.redirect_stdout(io.StringIO()):
    for words in (["--help"], ["run", "--help"], ["demo", "--help"], ["--version"], ["rum"]):
        main(words)
"""
"""Help of the program and of verbs, its version, and a verb that does not exist."""
EVERY_DETECTOR = """
from cdcore.detectors.detector_table import load_detector
from cdcore.detectors.detector_table import DETECTORS
for name in DETECTORS:
    load_detector(name)
"""
COMPUTES = """
import replay.engine, replay.auditing.misses, replay.auditing.compare
import replay.prepare.holding_poses, replay.document.summary
"""
"""Modules that compute and write nothing."""
WRITERS = {"rerun", "pyarrow", "rich", "matplotlib", "mcap", "click", "jinja2"}
"""Modules that read or write files and screens."""


@pytest.mark.parametrize(
    ("code", "never"),
    [
        pytest.param(
            "import cdcore.errors, sessions.errors, replay.errors", HEAVY, marks=pytest.mark.slow, id="a package"
        ),
        pytest.param(HELP, HEAVY, id="help and usage"),
        # Slow: it loads every kernel; import-linter sees what modules of the core import at their top.
        pytest.param(EVERY_DETECTOR, {*WRITERS, "sessions", "replay"}, marks=pytest.mark.slow, id="every detector"),
        pytest.param(
            "import sessions.mcap.reader",
            {"fcl", "numba", "trimesh", "cdcore", "replay", "rerun"},
            id="reading poses",
        ),
        pytest.param(
            "import sessions.glassware.catalogue",
            {"trimesh", "manifold3d"},
            marks=pytest.mark.slow,
            id="naming instruments",
        ),
        pytest.param(COMPUTES, WRITERS, marks=pytest.mark.slow, id="what computes"),
    ],
)
def test_command_imports_no_package_that_it_does_not_need(code, never):
    """``code`` runs in a new process, which then must not have loaded any of ``never``."""
    loaded = loaded_by(code)
    assert "sys" in loaded and not loaded & never
