"""Asking for help costs nothing: no numpy, no compiler, no pictures (``tests/bench`` times it)."""

import subprocess
import sys

import pytest

HEAVY = {
    "numpy", "scipy", "numba", "fcl", "trimesh", "rerun", "pyarrow", "rich", "matplotlib", "mcap", "google.protobuf",
    "jinja2",
}  # fmt: skip


def loaded_by(code):
    """Names of the modules that a program has loaded after this code."""
    program = f"import sys\n{code}\nprint('\\n'.join(sys.modules))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


HELP = """
import contextlib, io
from replay.cli.main import main
with contextlib.redirect_stdout(io.StringIO()):
    for words in (["--help"], ["run", "--help"], ["demo", "--help"], ["--version"], ["rum"]):
        main(words)
"""
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
WRITERS = {"rerun", "pyarrow", "rich", "matplotlib", "mcap", "click", "jinja2"}


@pytest.mark.parametrize(
    ("code", "never"),
    [
        pytest.param("import cdcore.errors, sessions.errors, replay.errors", HEAVY, marks=pytest.mark.slow),
        (HELP, HEAVY),
        # Slow: it loads every kernel; import-linter sees what modules of the core import at their top.
        pytest.param(EVERY_DETECTOR, {*WRITERS, "sessions", "replay"}, marks=pytest.mark.slow),
        ("import sessions.mcap.reader", {"fcl", "numba", "trimesh", "cdcore", "replay", "rerun"}),
        pytest.param("import sessions.glassware.catalogue", {"trimesh", "manifold3d"}, marks=pytest.mark.slow),
        pytest.param(COMPUTES, WRITERS, marks=pytest.mark.slow),
    ],
    ids=["a package", "help and usage", "every detector", "reading poses", "naming instruments", "what computes"],
)
def test_command_imports_no_package_that_it_does_not_need(code, never):
    """``code`` runs in a new process, which then must not have loaded any of ``never``."""
    assert not loaded_by(code) & never
