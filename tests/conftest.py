"""What holds for every test: slowness is no finding of a property test, and the table of effects keeps its order."""

import compileall
import gc
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from support.sampled import SAMPLED

settings.register_profile("any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("without slow tests", settings.get_profile("any machine"), max_examples=15)
settings.load_profile("any machine")

TOGETHER = (
    "tests/replay/studies/paper",
    "tests/replay/show/rerun_log",
    "tests/sessions/synthetic/experiments",
)
"""Folders whose files share what takes seconds to make."""


WITHOUT_KERNELS = (
    "tests/.ci",
    "tests/architecture",
    "tests/sessions/doctor",
    "tests/sessions/geometry",
    "tests/sessions/glassware",
    "tests/sessions/importers",
    "tests/sessions/mcap",
    "tests/sessions/meshes",
    "tests/sessions/model",
    "tests/sessions/recovery",
    "tests/sessions/scene_files",
    "tests/sessions/test_",
)
"""Folders whose tests compile nothing: they run first, while the kernels compile."""
LAST = (
    "tests/.ci/test_real_engines",
    "tests/.github",
    "tests/acceptance/test_thin_wall",
    "tests/architecture/test_documents",
    "tests/bench",
    "tests/cdcore",
    "tests/contracts",
    "tests/hard_cases",
)
"""Folders and files whose tests ask any detector, some in other processes: they run when all kernels are compiled.

Earlier they compile what is being compiled beside them: the first three, alone with an empty cache, take 74 s.
"""
COMPILING = pytest.StashKey[subprocess.Popen]()
KERNELS_ARE_THERE = pytest.StashKey[Path]()


os.environ["COLUMNS"] = "160"
"""Answers of commands are as wide as their widest table, so that a test finds a sentence in a line."""


def pytest_configure(config):
    """A property that asks for no number of examples gets 100, and 15 where slow tests are left out.

    Under ``-n`` what each worker would make again is made once: kernels in a process of their own, and before the
    workers begin what python and pytest make of the files.
    """
    if "not slow" in config.getoption("markexpr"):
        settings.load_profile("without slow tests")
    if hasattr(config, "workerinput"):
        sys.dont_write_bytecode = False
        config.stash[KERNELS_ARE_THERE] = Path(config.workerinput["kernels_are_there"])
    elif config.getoption("numprocesses", None) and not config.getoption("collectonly"):
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # of several workers' threads each waits for the other's
        paths = [str(config.rootpath), str(config.rootpath / "tests"), os.environ.get("PYTHONPATH", "")]
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths))}
        said = config.stash[KERNELS_ARE_THERE] = Path(tempfile.mkdtemp(prefix="kernels-")) / "compiled"
        program = [sys.executable, str(Path(__file__).parent / "support" / "compile_first.py"), str(said)]
        config.stash[COMPILING] = subprocess.Popen(program, env=environment)
        write_code(config)


def write_code(config):
    """Every file of the packages compiled, and every test file with its assertions rewritten, as pytest will read it.

    Workers begin together and read the same files at the same time, so none would find what another wrote.
    """
    for package in ("cdcore", "sessions", "replay", "tests/support"):
        compileall.compile_dir(config.rootpath / package, quiet=2)
    # Another pytest may not have these names, or take other arguments: then each worker writes its own, in seconds.
    gc.disable()
    with suppress(ImportError, AttributeError, TypeError):
        write_rewritten(config)
    gc.enable()


def write_rewritten(config):
    from _pytest.assertion import rewrite

    for file in (config.rootpath / "tests").rglob("test_*.py"):
        written = rewrite.get_cache_dir(file) / (file.name.removesuffix(".py") + rewrite.PYC_TAIL)
        if rewrite._read_pyc(file, written) is None:
            with suppress(SyntaxError):  # said where the tests are collected
                source, code = rewrite._rewrite_test(file, config)
                written.parent.mkdir(exist_ok=True)
                rewrite._write_pyc(config.stash[rewrite.assertstate_key], code, source, written)


@pytest.hookimpl(optionalhook=True)
def pytest_configure_node(node):
    """Each worker learns which file says that the common kernels are compiled."""
    node.workerinput["kernels_are_there"] = str(node.config.stash[KERNELS_ARE_THERE])


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """What needs no kernel comes first; else the order of the folders stays. Of ``SAMPLED`` most cases are slow."""
    seen = Counter()
    for item in items:
        name = item.nodeid.partition("::")[2].partition("[")[0]
        if seen[name] % SAMPLED.get(name, 1):
            item.add_marker(pytest.mark.slow)
        seen[name] += 1
    items.sort(key=lambda item: 2 * item.nodeid.startswith(LAST) - item.nodeid.startswith(WITHOUT_KERNELS))


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item):
    """No test of a worker begins before the kernels that it needs are there; a compiler that died is not waited for."""
    said = item.config.stash.get(KERNELS_ARE_THERE, None)
    if said and not item.nodeid.startswith(WITHOUT_KERNELS):
        while said.parent.exists() and not said.exists():
            time.sleep(0.05)


def pytest_unconfigure(config):
    """The process that compiles ends with the tests."""
    if compiling := config.stash.get(COMPILING, None):
        compiling.kill()
        compiling.wait()
        shutil.rmtree(config.stash[KERNELS_ARE_THERE].parent, ignore_errors=True)


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
