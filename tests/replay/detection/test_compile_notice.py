"""People hear once what is being compiled; who cannot speak hears nothing."""

import os
import sys
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import pytest
from numba import njit

from cdcore.kernels.compiling import engine_compiles
from replay.detection import compile_notice
from replay.detection.compile_notice import NOTICE_INTERVAL_S, compiling_announced
from replay.detection.progress import Silent


@pytest.fixture(autouse=True)
def paths_of_processes(monkeypatch):
    """Search paths for modules of each process that was started to compile beside this one; none of them runs.

    The machine has two cores, and so room for such a process.
    """
    paths = []
    monkeypatch.setattr(compile_notice.os, "cpu_count", lambda: 2)

    class Process:
        def __init__(self, command, *, env, **_):
            paths.append(env["PYTHONPATH"].split(os.pathsep))

        def kill(self):
            pass

    monkeypatch.setattr(compile_notice.subprocess, "Popen", Process)
    compile_notice.compile_beside.cache_clear()
    yield paths
    compile_notice.compile_beside.cache_clear()


class SentencesOnly:
    """A progress that keeps the sentences for people."""

    def __init__(self):
        self.sentences = []

    def say(self, sentence):
        self.sentences.append(sentence)


def fresh_kernel(module):
    """A kernel of this module that was never compiled."""

    def increased(x):
        return x + 1

    increased.__module__ = module
    return njit(increased)


def test_compiling_is_announced_once_with_its_duration():
    """Two kernels of this program are compiled, and one of another module, which all add 1: one announcement.

    It has a beginning, an end with the time, and a doubt about the times of this run.
    """
    progress = SentencesOnly()
    with compiling_announced(progress):
        assert fresh_kernel("cdcore.narrow.bvh.traverse")(1) == 2
        assert fresh_kernel("cdcore.narrow.sections.triangle_sections")(1) == 2
        assert fresh_kernel("elsewhere")(1) == 2
    beginning, end, doubt = progress.sentences
    assert beginning == "Compiling kernels for this machine, once"
    assert end.startswith("Compiled in ") and "run again for reliable times" in doubt


def test_a_single_process_compiles_beside_with_the_same_search_path(paths_of_processes, monkeypatch):
    """Two kernels of this program are compiled on a machine of two cores: one process compiles the others beside.

    It imports from where this one does; "" is the working folder.
    """
    monkeypatch.syspath_prepend("")
    with compiling_announced(SentencesOnly()):
        fresh_kernel("cdcore.narrow.bvh.traverse")(1)
        fresh_kernel("cdcore.narrow.bvh.frame_skips")(1)
    assert paths_of_processes == [[path or str(Path.cwd()) for path in sys.path]]


def test_notice_is_silent_without_compiling_and_afterwards(paths_of_processes):
    """Within the announcement a compiled kernel is called; a new one is compiled only after it."""
    progress, compiled_kernel = SentencesOnly(), fresh_kernel("cdcore.narrow.sections.triangle_sections")
    compiled_kernel(1)
    with compiling_announced(progress):
        compiled_kernel(2)
    fresh_kernel("cdcore.narrow.sections.triangle_sections")(1)
    assert progress.sentences == [] and paths_of_processes == []


def test_no_background_compiling_while_a_benchmark_needs_the_clock(paths_of_processes):
    """``is_alone``: no other process may run, though there is a second core; compiling here is still announced."""
    progress = SentencesOnly()
    with compiling_announced(progress, is_alone=True):
        fresh_kernel("cdcore.narrow.bvh.traverse")(1)
    assert paths_of_processes == []
    assert progress.sentences[-1].startswith("Compiled in ")


def test_engine_compilation_is_announced_at_its_start(paths_of_processes):
    """Newton, another engine, compiles its own kernels: no process is started that compiles this program's."""
    progress = SentencesOnly()
    with compiling_announced(progress), engine_compiles("Newton", "cache/warp"):
        assert progress.sentences == ["Compiling Newton's kernels for this machine, once; this can take minutes"]
    _beginning, end = progress.sentences[:2]
    assert end.endswith("; later starts load it from cache/warp")
    assert paths_of_processes == []


def test_long_compiling_is_announced_again_after_each_interval(monkeypatch):
    """The compiler reports how many seconds it has worked: 0, then just below and at one interval, and at two.

    Only the beginning and the two intervals are announced.
    """
    progress, listeners = SentencesOnly(), []

    @contextmanager
    def planted_compiler(listener):
        listeners.append(listener)
        yield SimpleNamespace(engine="Newton", kernels=0)

    monkeypatch.setattr("cdcore.kernels.compiling.compiling_reported", planted_compiler)
    with compiling_announced(progress):
        (report_seconds,) = listeners
        for seconds in (0.0, NOTICE_INTERVAL_S - 0.1, NOTICE_INTERVAL_S, 2 * NOTICE_INTERVAL_S):
            report_seconds(seconds)
    beginning, *later = progress.sentences
    assert "so far" not in beginning
    assert later == [f"{beginning} ({intervals * NOTICE_INTERVAL_S:g} s so far)" for intervals in (1, 2)]


def test_compiling_is_not_announced_to_silent_progress():
    """``Silent`` has no method for sentences, which is no error; the kernel, which adds 1, is compiled."""
    with compiling_announced(Silent()):
        assert fresh_kernel("cdcore.narrow.sections.triangle_sections")(1) == 2


@pytest.mark.parametrize(
    ("cores", "program", "processes"),
    [(2, "python", 1), (1, "python", 0), (None, "python", 0), (2, "", 0)],
    ids=["two cores", "one core", "cores not known", "Python embedded in another program"],
)
def test_kernels_compile_beside_where_a_second_core_is(monkeypatch, paths_of_processes, cores, program, processes):
    """``cores``: by the operating system; ``program``: path of this Python, with which a process can be started."""
    monkeypatch.setattr(compile_notice.os, "cpu_count", lambda: cores)
    monkeypatch.setattr(compile_notice.sys, "executable", program)
    compile_notice.compile_beside()
    assert len(paths_of_processes) == processes
