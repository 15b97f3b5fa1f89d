"""Machine code on disk: whole files come back, anything else counts as absent and is compiled again."""

import shutil

import numba
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import types
from numba.core.caching import IndexDataCacheFile

from cdcore.kernels import compiling
from cdcore.kernels.compiling import kernel
from cdcore.kernels.machine_code import MachineCodeFiles

KEY = ((types.float64, types.int64), ("x86_64", "some processor"), ("bytecode", "cells"))
OTHER_KEY = ((types.int64,), *KEY[1:])
STAMP = "source"


def files_of(folder, name="traverse.search_pairs-281.py311", stamp=STAMP):
    folder.mkdir(exist_ok=True)
    return MachineCodeFiles(folder=folder, name=name, source_stamp=stamp)


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """A folder with two signatures of one kernel."""
    folder = tmp_path_factory.mktemp("module") / "bvh"
    files = files_of(folder)
    files.save(KEY, {"code": b"first" * 100})
    files.save(OTHER_KEY, {"code": b"second" * 100})
    return folder


def test_saved_machine_code_comes_back(saved):
    assert files_of(saved).load(KEY) == {"code": b"first" * 100}
    assert files_of(saved).load(OTHER_KEY) == {"code": b"second" * 100}
    assert files_of(saved).load(((), *KEY[1:])) is None


@given(data=st.data())
def test_machine_code_with_changed_bytes_is_not_loaded(saved, tmp_path_factory, data):
    folder = tmp_path_factory.mktemp("copy") / saved.name
    shutil.copytree(saved, folder)
    file = data.draw(st.sampled_from(sorted(folder.iterdir(), key=lambda file: file.suffix)))
    content = bytearray(file.read_bytes())
    start = data.draw(st.integers(0, len(content) - 1))
    change = data.draw(st.binary(min_size=1, max_size=64).filter(any))
    for position, mask in zip(range(start, len(content)), change, strict=False):
        content[position] ^= mask
    changed = bytes(content) != file.read_bytes()
    file.write_bytes(bytes(content))
    answers = [files_of(folder).load(key) for key in (KEY, OTHER_KEY)]
    assert answers.count(None) == (2 if file.suffix == ".nbi" else 1) * changed


@pytest.mark.parametrize("length", [0, 1, 31, 32, 33, 100])
@pytest.mark.parametrize("suffix", [".nbi", ".nbc"])
def test_machine_code_cut_short_is_not_loaded(saved, tmp_path, suffix, length):
    folder = shutil.copytree(saved, tmp_path / saved.name)
    for file in folder.glob(f"*{suffix}"):
        file.write_bytes(file.read_bytes()[:length])
    assert files_of(folder).load(KEY) is None


def test_swapped_machine_code_is_not_loaded(saved, tmp_path):
    folder = shutil.copytree(saved, tmp_path / saved.name)
    first, second = folder.glob("*.nbc")
    content = first.read_bytes()
    first.write_bytes(second.read_bytes())
    second.write_bytes(content)
    assert files_of(folder).load(KEY) is None and files_of(folder).load(OTHER_KEY) is None


def test_foreign_or_stale_index_is_not_read(saved, tmp_path, monkeypatch):
    folder = shutil.copytree(saved, tmp_path / saved.name)
    (index,) = folder.glob("*.nbi")
    shutil.copy(index, folder / "traverse.other-9.py311.nbi")
    assert files_of(folder, name="traverse.other-9.py311").load(KEY) is None
    assert files_of(folder, stamp="changed source").load(KEY) is None
    assert files_of(folder.rename(tmp_path / "other_module")).load(KEY) is None
    monkeypatch.setattr(numba, "__version__", "0.0")
    assert files_of(saved).load(KEY) is None


def test_an_older_index_names_no_newer_machine_code(tmp_path):
    older, newer = files_of(tmp_path / "bvh"), files_of(tmp_path / "bvh")
    older.save(KEY, "older")
    (index,) = (tmp_path / "bvh").glob("*.nbi")
    content = index.read_bytes()
    newer.save(KEY, "newer")
    index.write_bytes(content)
    assert older.load(KEY) is None
    assert len([*(tmp_path / "bvh").glob("*.nbc")]) == 1, "replaced machine code is removed"


def test_files_in_the_format_of_numba_are_not_loaded(tmp_path):
    own = IndexDataCacheFile(str(tmp_path), "traverse.search_pairs-281.py311", STAMP)
    own.save(KEY, "numba's")
    assert own.load(KEY) == "numba's" and files_of(tmp_path).load(KEY) is None


def test_a_failed_write_leaves_the_machine_code_of_before(saved, tmp_path, monkeypatch):
    folder = shutil.copytree(saved, tmp_path / saved.name)
    before = sorted(file.name for file in folder.iterdir())

    def interrupted(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("cdcore.kernels.machine_code.Path.replace", interrupted)
        with pytest.raises(KeyboardInterrupt):
            files_of(folder).save(KEY, "new")
    assert sorted(file.name for file in folder.iterdir()) == before
    assert files_of(folder).load(KEY) == {"code": b"first" * 100}


@pytest.mark.parametrize("kind", ["nbi", "nbc"])
def test_a_damaged_kernel_is_compiled_again_and_kept(tmp_path, monkeypatch, kind):
    monkeypatch.setattr(compiling, "kernel_folder", lambda: tmp_path)
    first = kernel(lambda x: x * x + 7)
    assert first(2) == 11 and first.stats.cache_misses
    (file,) = tmp_path.rglob(f"*.{kind}")
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 1
    file.write_bytes(bytes(content))
    second = kernel(first.py_func)
    assert second(2) == 11 and second.stats.cache_misses
    third = kernel(first.py_func)
    assert third(2) == 11 and third.stats.cache_hits and not third.stats.cache_misses


def test_a_numba_without_the_expected_names_keeps_nothing():
    class Cache:
        enabled = True

        def disable(self):
            self.enabled = False

    cache = Cache()
    compiling._verify_machine_code(cache)
    assert not cache.enabled
