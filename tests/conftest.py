"""What holds for every test: slowness is no finding of a property test, and the table of effects keeps its order."""

import gc
import os
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

settings.register_profile("any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("without slow tests", settings.get_profile("any machine"), max_examples=40)
settings.load_profile("any machine")

TOGETHER = (
    "tests/replay/studies/paper",
    "tests/replay/outputs/rerun_log",
    "tests/sessions/synthetic/experiments",
)
"""Folders whose files share what takes seconds to make."""


COMPILING = pytest.StashKey[subprocess.Popen]()
COMPILED = pytest.StashKey[bool]()


def pytest_configure(config):
    """A property that asks for no number of examples gets 100, and 40 where slow tests are left out.

    Under ``-n`` kernels are compiled in a process of their own while the workers look for tests: otherwise each worker
    compiles them all. And what pytest makes of the test files is written down, or each worker makes it again.
    """
    if "not slow" in config.getoption("markexpr"):
        settings.load_profile("without slow tests")
    if hasattr(config, "workerinput"):
        sys.dont_write_bytecode = False
    elif config.getoption("numprocesses", None) and not config.getoption("collectonly"):
        paths = [str(config.rootpath), str(config.rootpath / "tests"), os.environ.get("PYTHONPATH", "")]
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths))}
        program = [sys.executable, str(Path(__file__).parent / "support" / "compile_first.py")]
        config.stash[COMPILING] = subprocess.Popen(program, stdout=subprocess.PIPE, env=environment)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_node_collection_finished(node):
    """No test begins before the kernels that most of them need are there."""
    if (compiling := node.config.stash.get(COMPILING, None)) and not node.config.stash.get(COMPILED, False):
        node.config.stash[COMPILED] = bool(compiling.stdout.readline())


def pytest_unconfigure(config):
    """The process that compiles ends with the tests."""
    if compiling := config.stash.get(COMPILING, None):
        compiling.kill()
        compiling.communicate()


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


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """Under ``-n`` a file stays in one process, and so do the files of the folders ``TOGETHER``.

    Files share what they made. They are given out in their order: the acceptance tests, which take longest, come
    first; by number of tests they, which have one or two, would come last and leave the other processes idle.
    """
    from xdist.scheduler import LoadFileScheduling

    class LoadTogether(LoadFileScheduling):
        def _split_scope(self, nodeid):
            file = super()._split_scope(nodeid)
            folder = file.rpartition("/")[0]
            return folder if folder in TOGETHER else file

    config.option.loadscopereorder = False
    return LoadTogether(config, log)


@pytest.fixture(autouse=True)
def the_table_of_effects_in_its_order():
    """Rows that a test takes out come back at the end; other tests read the order of the table."""
    effects = sys.modules.get("replay.effects")
    before = dict(effects.EFFECTS) if effects else {}
    yield
    if before and list(effects.EFFECTS) != list(before):
        effects.EFFECTS.clear()
        effects.EFFECTS.update(before)
