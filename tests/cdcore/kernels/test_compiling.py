"""Marked kernels stay callable, are compiled once, and read through an address what the array holds."""

import gc
import os
import pickle
import subprocess
import sys
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
from cdcore.kernels.compiling import Compiled, hot_kernel, kernel, quick_compilers, stay_one_function
from cdcore.kernels.memory import address_of, bytes_at, doubles_at, doubles_of, integers_at, row_of, words_at, words_of
from cdcore.kernels.simd import load8, store


@njit
def doubled(x):
    stay_one_function()
    return 2 * x


READ_ONLY = """
import os, sys
from pathlib import Path
import numba.core.caching as caching

def refuse(self):
    raise PermissionError("read-only")

def locator(name):  # numba 0.61 writes a line before the names
    return getattr(caching, name, None) or getattr(caching, "_" + name)

locator("InTreeCacheLocator").ensure_cache_path = refuse
{more}
from cdcore.narrow.image_space.layers import pixels_of_face
print(pixels_of_face(3.0, 4.0, 0.0, 1.0, 8) == (2, 6), pixels_of_face.stats.cache_path)
"""


def compiled_elsewhere(tmp_path, more=""):
    environment = os.environ | {"XDG_CACHE_HOME": str(tmp_path), "LOCALAPPDATA": str(tmp_path), "HOME": str(tmp_path)}
    environment.pop("NUMBA_CACHE_DIR", None)
    code = READ_ONLY.format(more=more)
    answer = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    return answer.stdout.rsplit(" ", 1)


@pytest.mark.slow
def test_an_installation_that_cannot_be_written_keeps_machine_code_in_the_users_cache_folder(tmp_path):
    answer, folder = compiled_elsewhere(tmp_path)
    assert answer == "True"
    assert tmp_path in Path(folder.strip()).parents
    assert list(tmp_path.rglob("layers.pixels_of_face*.nbi"))


@pytest.mark.slow
def test_where_nothing_can_be_written_kernels_compile_at_every_start(tmp_path):
    answer, folder = compiled_elsewhere(tmp_path, 'locator("UserWideCacheLocator").ensure_cache_path = refuse')
    assert answer == "True"
    assert folder.strip() == "None"
    assert not list(tmp_path.rglob("*.nbi"))


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
            assert gc.isenabled() == on
        finally:
            gc.enable()


@pytest.mark.parametrize(("version", "quick"), [((0, 60), 0), ((0, 61), 1), ((0, 68), 1), ((0, 69), 0), ((1, 0), 0)])
def test_only_versions_of_numba_that_were_tried_compile_the_quick_way(version, quick, monkeypatch):
    monkeypatch.setattr(numba, "version_info", SimpleNamespace(short=version))
    assert [len(options) for options in quick_compilers.__wrapped__()] == [quick, quick]


def test_without_the_quick_way_kernels_and_their_parts_compute_the_same(monkeypatch):
    monkeypatch.setattr(compiling, "quick_compilers", lambda: ({}, {}))
    part = hot_kernel(lambda x: x * x + 1)
    asked = kernel(lambda x: part(x) + part(x + 1))
    asked._cache = type(asked)(asked.py_func)._cache  # no disk: this test compiles
    assert asked(3.0) == 10.0 + 17.0


def test_a_full_disk_under_the_cache_costs_no_answer_and_leaves_no_index_to_code_of_earlier_sources(monkeypatch):
    def full(name, data):
        raise OSError(ENOSPC, "No space left on device")

    asked = kernel(lambda x: x * x + 3)
    files = asked._cache._cache_file
    monkeypatch.setattr(files, "_save_data", full)
    index = Path(files._index_path)
    index.unlink(missing_ok=True)
    assert asked(2.0) == 7.0 and not index.exists()
    monkeypatch.undo()
    assert asked(2) == 7 and index.is_file()


def test_an_index_that_names_what_other_sources_had_is_dropped_and_the_kernel_compiled_anew():
    asked = kernel(lambda x: x * x + 5)
    index = Path(asked._cache._cache_file._index_path)
    assert asked(2) == 9
    index.write_bytes(pickle.dumps(numba.__version__) + b"ccdcore.mesh\nNoSuchName\n.")
    again = kernel(asked.py_func)
    assert again(2) == 9 and again.stats.cache_misses and index.is_file()


@kernel
def doubled_memory(row, count):
    small, middle, large, real = bytes_at(row[0]), integers_at(row[1]), words_at(row[2]), doubles_at(row[3])
    for k in range(count):
        small[k] = 2 * small[k]
        large[k] = 2 * large[k] + middle[k]
    value = load8(real, 1)
    store(real, 0 * count, value)
    return real[count]


def test_every_kind_of_number_is_read_and_written_in_place():
    arrays = [np.arange(12).astype(kind) for kind in (np.uint8, np.int32, np.int64, np.float64)]
    assert doubled_memory(row_of(arrays), 10) == 10.0
    assert arrays[0].tolist() == [*range(0, 20, 2), 10, 11]
    assert arrays[1].tolist() == list(range(12))
    assert arrays[2].tolist() == [*range(0, 30, 3), 10, 11]
    assert arrays[3].tolist() == [*range(1, 9), *range(8, 12)]


@kernel
def last_of_rows(real, whole):
    return doubles_of(real)[5], words_of(whole)[5], doubles_of(doubles_of(real))[0]


def test_an_array_of_rows_is_one_row_in_a_kernel():
    assert last_of_rows(np.arange(6.0).reshape(2, 3) + 1, np.arange(6).reshape(3, 2)) == (6.0, 5, 1.0)


def test_a_row_keeps_numbers_as_they_are():
    array = np.zeros(3)
    assert row_of([7, array]).tolist() == [7, array.ctypes.data] == [7, address_of(array)]


def test_an_array_with_gaps_has_no_address():
    with pytest.raises(AssertionError):
        address_of(np.zeros((4, 4))[:, 1])


def test_a_kernel_takes_no_address_of_an_array_with_gaps():
    with pytest.raises(TypingError, match="make this one contiguous first"):
        last_of_rows(np.zeros((6, 2))[:, 0], np.zeros(6, dtype=np.int64))
