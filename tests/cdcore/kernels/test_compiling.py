"""Marked kernels stay callable, are compiled once, and read through an address what the array holds."""

import gc
import os
import pickle
import subprocess
import sys
import tempfile
from errno import ENOSPC
from pathlib import Path
from types import SimpleNamespace

import numba
import numpy as np
import pytest
from numba import njit
from numba.core.errors import TypingError
from numba.core.event import Event

from cdcore.kernels import compiling
from cdcore.kernels.compiling import Compiled, hot_kernel, kernel, kernel_folder, never_inlined, quick_compilers
from cdcore.kernels.memory import address_of, doubles_at, doubles_of, integers_of
from cdcore.kernels.simd import load8, store


@njit
def doubled(x):
    never_inlined()
    return 2 * x


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """Three source files of an installation, whose user has a cache folder; returns the package."""
    package = tmp_path / "site" / "cdcore"
    for name in ("kernels/compiling.py", "narrow/bvh/traverse.py", "numerics.py"):
        (package / name).parent.mkdir(parents=True, exist_ok=True)
        (package / name).write_text(f"# {name}")
    monkeypatch.setattr(compiling, "__file__", str(package / "kernels" / "compiling.py"))
    monkeypatch.setattr(compiling, "user_cache_path", lambda *_, **__: tmp_path / "user")
    monkeypatch.setattr(numba.config, "CACHE_DIR", "")
    return package


folder_now = kernel_folder.__wrapped__


@pytest.mark.parametrize("changed", ["narrow/bvh/traverse.py", "numerics.py"])
def test_changed_sources_replace_the_cache_folder(installed, changed):
    before = folder_now()
    (before / "code").write_text("machine code")
    os.utime(installed / changed)
    assert folder_now() == before and (before / "code").exists(), "a new time alone changes nothing"
    (installed / changed).write_text("# changed")
    assert folder_now() != before and not before.exists()


def test_machine_code_folder_falls_back_in_order(installed, tmp_path, monkeypatch):
    refused = []

    def write(dir):
        if any(position in dir.parents for position in refused):
            raise PermissionError("read-only")
        return tempfile.TemporaryFile(dir=dir)

    monkeypatch.setattr(compiling, "TemporaryFile", write)
    for position in (installed, tmp_path / "user"):
        assert position in folder_now().parents
        refused.append(position)
    assert folder_now() is None
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / "own"))
    assert folder_now().parent == tmp_path / "own"


def test_installations_sharing_a_folder_keep_separate_machine_code(installed, tmp_path, monkeypatch):
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / "shared"))
    first = folder_now()
    other = installed.rename(installed.with_name("other"))
    monkeypatch.setattr(compiling, "__file__", str(other / "kernels" / "compiling.py"))
    assert folder_now() != first and first.exists()


def test_where_nothing_can_be_written_kernels_compute_the_same(monkeypatch):
    monkeypatch.setattr(compiling, "kernel_folder", lambda: None)
    requested = kernel(lambda x: x * x + 2)
    assert requested(2.0) == 6.0 and requested.stats.cache_path is None


@pytest.fixture
def kept(tmp_path, monkeypatch):
    """A folder for the machine code of kernels that the test marks."""
    monkeypatch.setattr(compiling, "kernel_folder", lambda: tmp_path)
    return tmp_path


def test_full_disk_costs_no_answer_and_keeps_numba_settings(kept, monkeypatch):
    def full(*_):
        raise OSError(ENOSPC, "No space left on device")

    given = numba.config.CACHE_DIR
    requested = kernel(lambda x: x * x + 3)
    assert given == numba.config.CACHE_DIR
    with monkeypatch.context() as patch:
        patch.setattr(Path, "replace", full)
        assert requested(2.0) == 7.0 and not list(kept.rglob("*.nb?"))
    assert requested(2) == 7 and list(kept.rglob("*.nbi"))


@pytest.mark.parametrize("kind", ["nbi", "nbc"])
@pytest.mark.parametrize("content", [b"", pickle.dumps(numba.__version__) + b"ccdcore.mesh\nNoSuchName\n."])
def test_a_spoiled_file_costs_no_answer(kept, kind, content):
    requested = kernel(lambda x: x * x + 5)
    assert requested(2) == 9
    (spoiled,) = kept.rglob(f"*.{kind}")
    spoiled.write_bytes(content)
    again = kernel(requested.py_func)
    assert again(2) == 9 and again.stats.cache_misses


TOGETHER = """
from cdcore.kernels.compiling import compiling_reported
from cdcore.image_space.layers import pixels_of_face
with compiling_reported(lambda seconds: None) as heard:
    assert pixels_of_face(3.0, 4.0, 0.0, 1.0, 8) == (3, 6)
print(heard.kernels)
"""


@pytest.mark.slow
def test_simultaneous_processes_answer_and_later_processes_compile_nothing(tmp_path):
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    start = [sys.executable, "-c", TOGETHER]
    both = [subprocess.Popen(start, env=environment) for _ in range(2)]
    assert [process.wait(60) for process in both] == [0, 0]
    assert subprocess.check_output(start, env=environment, text=True).strip() == "0"


def test_the_collector_rests_while_kernels_compile_and_only_then():
    heard = Compiled(lambda seconds: None)
    kernel = Event("numba:compile", "START", {"dispatcher": doubled})
    for on in (True, False):
        gc.enable() if on else gc.disable()
        try:
            heard.on_start(kernel)
            heard.on_start(kernel)
            assert not gc.isenabled()
            heard.on_end(kernel)
            assert not gc.isenabled()
            heard.on_end(kernel)
            assert gc.isenabled() == on and 0.0 <= heard.seconds < 60.0
        finally:
            gc.enable()


@pytest.mark.parametrize(("version", "quick"), [((0, 60), 0), ((0, 61), 1), ((0, 68), 1), ((0, 69), 0), ((1, 0), 0)])
def test_only_tried_numba_versions_use_the_quick_compiler(version, quick, monkeypatch):
    monkeypatch.setattr(numba, "version_info", SimpleNamespace(short=version))
    assert [len(options) for options in quick_compilers.__wrapped__()] == [quick, quick]


def test_standard_compiler_computes_the_same(kept, monkeypatch):
    monkeypatch.setattr(compiling, "quick_compilers", lambda: ({}, {}))
    component = hot_kernel(lambda x: x * x + 1)
    requested = kernel(lambda x: component(x) + component(x + 1))
    assert requested(3.0) == 10.0 + 17.0


@kernel
def moved_by_one(address, count):
    numbers = doubles_at(address)
    store(numbers, 0 * count, load8(numbers, 1))
    numbers[count] = 2 * numbers[count]
    return numbers[count]


def test_numbers_are_read_and_written_at_their_address():
    array = np.arange(12.0)
    assert moved_by_one(address_of(array), 10) == 20.0
    assert array.tolist() == [*range(1, 9), 8, 9, 20, 11]


@kernel
def last_of_rows(real, whole):
    return doubles_of(real)[5], integers_of(whole)[5], doubles_of(doubles_of(real))[0]


def test_array_of_rows_is_a_single_row_in_a_kernel():
    assert last_of_rows(np.arange(6.0).reshape(2, 3) + 1, np.arange(6).reshape(3, 2)) == (6.0, 5, 1.0)


def test_an_array_with_gaps_has_no_address():
    with pytest.raises(AssertionError):
        address_of(np.zeros((4, 4))[:, 1])


def test_a_kernel_takes_no_address_of_an_array_with_gaps():
    with pytest.raises(TypingError, match="make this one contiguous first"):
        last_of_rows(np.zeros((6, 2))[:, 0], np.zeros(6, dtype=np.int64))
