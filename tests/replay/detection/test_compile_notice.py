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
def started(monkeypatch):
    """Search paths for modules of the processes that were started; none of them runs."""
    paths = []

    class Process:
        def __init__(self, command, *, env, **_):
            paths.append(env["PYTHONPATH"].split(os.pathsep))

        def kill(self):
            pass

    monkeypatch.setattr(compile_notice.subprocess, "Popen", Process)
    compile_notice.compile_beside.cache_clear()
    yield paths
    compile_notice.compile_beside.cache_clear()


class Heard:
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


def test_compiling_is_announced_once_with_its_duration(started, monkeypatch):
    """Three kernels of this program are compiled, and one of another module, in one announcement.

    A process that compiles beside is started once, with this one's search path ("" is the working folder).
    """
    monkeypatch.syspath_prepend("")
    heard = Heard()
    with compiling_announced(heard):
        assert fresh_kernel("cdcore.narrow.bvh.traverse")(1) == 2
        assert fresh_kernel("cdcore.narrow.bvh.frame_skips")(1) == 2
        assert fresh_kernel("cdcore.narrow.sections.triangle_sections")(1) == 2
        assert fresh_kernel("elsewhere")(1) == 2
    first, end, doubt = heard.sentences
    assert first == "Compiling kernels for this machine, once"
    assert end.startswith("Compiled in ") and "run again for reliable times" in doubt
    assert started == [[item or str(Path.cwd()) for item in sys.path]] * (os.cpu_count() > 1), "once, beside this one"


def test_notice_is_silent_without_compiling_and_afterwards(started):
    """Within the announcement a compiled kernel is called; a new one is compiled only after it."""
    heard, known = Heard(), fresh_kernel("cdcore.narrow.sections.triangle_sections")
    known(1)
    with compiling_announced(heard):
        known(2)
    fresh_kernel("cdcore.narrow.sections.triangle_sections")(1)
    assert heard.sentences == [] and started == []


def test_no_background_compiling_while_a_benchmark_needs_the_clock(started):
    """``is_alone``: no other process may run; compiling here is still announced."""
    heard = Heard()
    with compiling_announced(heard, is_alone=True):
        fresh_kernel("cdcore.narrow.bvh.traverse")(1)
    assert started == [] and heard.sentences[-1].startswith("Compiled in ")


def test_engine_compilation_is_announced_at_its_start(started):
    """Newton compiles its own kernels, so no process that compiles this program's is started."""
    heard = Heard()
    with compiling_announced(heard), engine_compiles("Newton", "cache/warp"):
        assert heard.sentences == ["Compiling Newton's kernels for this machine, once; this can take minutes"]
    assert heard.sentences[1].endswith("; later starts load it from cache/warp")
    assert started == [], "no kernels of ours are needed beside"


def test_long_compiling_is_announced_again_after_each_interval(monkeypatch):
    """The compiler tells how many seconds it has worked: 0, then just below and at one interval, and at two."""
    heard, listeners = Heard(), []

    @contextmanager
    def reported(tell):
        listeners.append(tell)
        yield SimpleNamespace(engine="Newton", kernels=0)

    monkeypatch.setattr("cdcore.kernels.compiling.compiling_reported", reported)
    with compiling_announced(heard):
        for seconds in (0.0, NOTICE_INTERVAL_S - 0.1, NOTICE_INTERVAL_S, 2 * NOTICE_INTERVAL_S):
            listeners[0](seconds)
    first, *later = heard.sentences
    assert "so far" not in first
    assert later == [f"{first} ({times * NOTICE_INTERVAL_S:g} s so far)" for times in (1, 2)]


@pytest.mark.parametrize("cores", [1, None])
def test_single_core_starts_no_process(cores, started, monkeypatch):
    """``cores``: by the operating system; None: it does not know."""
    monkeypatch.setattr(compile_notice.os, "cpu_count", lambda: cores)
    compile_notice.compile_beside()
    assert started == []


def test_compiling_is_not_announced_to_silent_progress():
    """``Silent`` has no way to say a sentence; the kernel adds 1."""
    with compiling_announced(Silent()):
        assert fresh_kernel("cdcore.narrow.sections.triangle_sections")(1) == 2


@pytest.mark.parametrize(
    ("cores", "program", "count"), [(2, "python", 1), (1, "python", 0), (None, "python", 0), (2, "", 0)]
)
def test_kernels_compile_beside_where_a_second_core_is(monkeypatch, started, cores, program, count):
    """``program``: this Python's own path, empty where it is embedded in another program; ``cores`` may be unknown."""
    monkeypatch.setattr(compile_notice.os, "cpu_count", lambda: cores)
    monkeypatch.setattr(compile_notice.sys, "executable", program)
    compile_notice.compile_beside()
    assert len(started) == count
