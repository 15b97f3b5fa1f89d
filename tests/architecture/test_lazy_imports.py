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


@pytest.mark.parametrize(
    "package", ["cdcore", "cdcore.errors", "sessions", "sessions.errors", "replay", "replay.errors"]
)
def test_importing_a_package_loads_nothing_heavy(package):
    assert not loaded_by(f"import {package}") & HEAVY


@pytest.mark.parametrize("arguments", [["--help"], ["run", "--help"], ["demo", "--help"], ["--version"], ["rum"]])
def test_help_and_usage_load_nothing_heavy(arguments):
    quiet = "import contextlib, io\nwith contextlib.redirect_stdout(io.StringIO()):"
    assert not loaded_by(f"from replay.cli.main import main\n{quiet} main({arguments})") & HEAVY


def test_the_core_never_loads_what_only_the_tool_needs():
    every = "for name in DETECTORS: load_detector(name)"
    code = f"from cdcore.detectors import DETECTORS, load_detector\n{every}"
    assert not loaded_by(code) & {"rerun", "pyarrow", "rich", "matplotlib", "mcap", "click", "sessions", "replay"}


def test_sessions_never_load_a_geometry_engine_to_read_poses():
    assert not loaded_by("import sessions.mcap_format.reader") & {
        "fcl",
        "numba",
        "trimesh",
        "cdcore",
        "replay",
        "rerun",
    }


def test_what_computes_does_not_know_who_writes():
    modules = "pipeline.engine", "comparison.misses", "comparison.compare", "prepare.holding_poses"
    names = ", ".join(f"replay.{module}" for module in (*modules, "pipeline.summary"))
    assert not loaded_by(f"import {names}") & {"rerun", "pyarrow", "rich", "click", "mcap", "matplotlib"}


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
    for _ in range(9):
        start = children_seconds()
        subprocess.run([sys.executable, "-m", "replay", "--help"], capture_output=True, check=True)
        taken.append(children_seconds() - start)
    assert 0.0 < min(taken) < PROMISED, sorted(taken)
