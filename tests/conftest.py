"""Profiles of Hypothesis, kernels compiled once for all workers, and tests of which a sample of cases is quick."""

import gc
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from support.processes import environment

settings.register_profile("fresh", deadline=None, print_blob=True, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("repeated", settings.get_profile("fresh"), derandomize=True)
settings.register_profile("repeated, quick", settings.get_profile("repeated"), max_examples=15)
settings.load_profile("repeated")

COMPILER = pytest.StashKey[subprocess.Popen]()
KERNELS_FILE = "TESTS_KERNELS_FILE"
"""Variable of a worker: the path of the file that appears when the common kernels are compiled."""

os.environ["COLUMNS"] = "160"
"""Answers of commands are as wide as their widest table, so that a test finds a sentence in a line."""


def pytest_configure(config):
    """Kernels compile beside workers; examples of a property come from a fixed seed, 15 without slow tests, or 100.

    ``--hypothesis-profile fresh`` draws 100 new ones, as the weekly run does: a release does not depend on a draw.
    """
    if "not slow" in config.getoption("markexpr") and not config.getoption("--hypothesis-profile"):
        settings.load_profile("repeated, quick")
    keep_bytecode(config)
    if config.getoption("numprocesses", None) and not config.getoption("collectonly"):
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # threads of several workers wait for each other
        compiled = Path(tempfile.mkdtemp(prefix="kernels-")) / "compiled"
        os.environ[KERNELS_FILE] = str(compiled)
        code = "import sys; from support.processes import compile_for_tests; compile_for_tests(sys.argv[1])"
        config.stash[COMPILER] = subprocess.Popen([sys.executable, "-c", code, str(compiled)], env=environment())


def keep_bytecode(config):
    """Keeps compiled modules in pytest's cache where the user wants none beside the sources.

    Each program that tests start would compile hundreds of files again: 4.4 s of processor time for 1.5 s.
    """
    if sys.dont_write_bytecode and hasattr(config, "cache"):
        sys.pycache_prefix = os.environ["PYTHONPYCACHEPREFIX"] = str(config.cache.mkdir("bytecode"))
        sys.dont_write_bytecode = False
        os.environ.pop("PYTHONDONTWRITEBYTECODE", None)


def pytest_unconfigure(config):
    """The process that compiles ends with the tests."""
    if compiler := config.stash.get(COMPILER, None):
        compiler.kill()
        compiler.wait()
        shutil.rmtree(Path(os.environ.pop(KERNELS_FILE)).parent, ignore_errors=True)


@pytest.fixture(scope="session")
def common_kernels():
    """Waits until the common kernels are compiled; a compiler that died is not waited for."""
    if file := os.environ.get(KERNELS_FILE):
        while Path(file).parent.exists() and not Path(file).exists():
            time.sleep(0.05)


@pytest.fixture(scope="session")
def shared_pieces(tmp_path_factory):
    """Keeps convex pieces for the tests of all workers; the user's own cache is neither read nor written."""
    folder = tmp_path_factory.getbasetemp()
    folder = (folder.parent if "PYTEST_XDIST_WORKER" in os.environ else folder) / "pieces"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("replay.cutting.piece_store.cache_folder", lambda: folder)
        yield


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Marks all cases but one in ``n`` of a test marked ``sampled(n)`` as slow."""
    cases = Counter()
    for item in items:
        if marker := item.get_closest_marker("sampled"):
            test = item.nodeid.partition("[")[0]
            if cases[test] % marker.args[0]:
                item.add_marker(pytest.mark.slow)
            cases[test] += 1


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Modules and tests live to the end: the garbage collector never looks through them, half a second each time."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.set_threshold(20_000, 20, 20)
        gc.enable()
