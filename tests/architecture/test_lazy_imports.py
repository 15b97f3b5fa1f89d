"""Asking for help costs nothing: no numpy, no compiler, no pictures, and an answer before one looks up."""

import subprocess
import sys
from time import perf_counter

import pytest

HEAVY = {
    "numpy", "scipy", "numba", "fcl", "trimesh", "rerun", "pyarrow", "rich", "matplotlib", "mcap", "google.protobuf",
}  # fmt: skip

PROMISED = 0.150
"""Processor seconds that ``replay --help`` may take, the quickest of several: neighbours cost cache misses."""


def loaded_by(code):
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
from cdcore.detectors import DETECTORS, load_detector
for name in DETECTORS:
    load_detector(name)
"""
COMPUTES = """
import replay.pipeline.engine, replay.comparison.misses, replay.comparison.compare
import replay.prepare.holding_poses, replay.pipeline.summary
"""
WRITERS = {"rerun", "pyarrow", "rich", "matplotlib", "mcap", "click"}


@pytest.mark.parametrize(
    ("code", "never"),
    [
        ("import cdcore.errors, sessions.errors, replay.errors", HEAVY),
        (HELP, HEAVY),
        (EVERY_DETECTOR, {*WRITERS, "sessions", "replay"}),
        ("import sessions.mcap_format.reader", {"fcl", "numba", "trimesh", "cdcore", "replay", "rerun"}),
        ("import sessions.glassware.catalogue", {"trimesh", "manifold3d"}),
        (COMPUTES, WRITERS),
    ],
    ids=["a package", "help and usage", "every detector", "reading poses", "naming instruments", "what computes"],
)
def test_it_loads_nothing_that_it_does_not_need(code, never):
    assert not loaded_by(code) & never


def children_seconds():
    """Processor seconds of ended children where the system counts them, else the clock on the wall."""
    try:
        import resource
    except ImportError:
        return perf_counter()
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def test_help_answers_at_once():
    taken = []
    for _ in range(5):
        start = children_seconds()
        subprocess.run([sys.executable, "-m", "replay", "--help"], capture_output=True, check=True)
        taken.append(children_seconds() - start)
    assert 0.0 < min(taken) < PROMISED, sorted(taken)
