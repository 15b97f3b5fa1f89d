"""Cache files of a kernel: whole ones are loaded, anything else is removed and compiled again.

numba caches an index (.nbi) of a kernel and its machine code (.nbc), a file for each signature; a seal (.seal) beside
them has their checksums. ``remove_unless_intact`` removes what does not match, and returns whether numba may load what
remains: False only where damaged files cannot be removed.
"""

import shutil
from threading import Thread
from time import monotonic

import numba
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdcore.kernels import cache_seals
from cdcore.kernels.cache_seals import KernelCache
from cdcore.kernels.compiling import kernel


@pytest.fixture(autouse=True)
def outdated_files_are_removed_in_each_test():
    """Folders are searched for outdated files once a process; here once a test."""
    cache_seals.remove_outdated.cache_clear()
    yield
    cache_seals.remove_outdated.cache_clear()


def square_plus_seven(x):
    """A small kernel."""
    return x * x + 7


NAMES = (
    "module.square_plus_seven-9{python}.nbi",
    "module.square_plus_seven-9{python}.1.nbc",
    "module.square_plus_seven-9{python}.2.nbc",
)


@pytest.fixture(scope="module")
def sealed_folder(tmp_path_factory):
    """A folder "bvh" with the index and two files of machine code of the kernel at line 9 of module.py,
    and its seal.
    """
    folder = tmp_path_factory.mktemp("module") / "bvh"
    folder.mkdir()
    for number, name in enumerate(NAMES):
        (folder / name.format(python=cache_seals.PYTHON)).write_bytes(b"content %d" % number * 99)
    cache_of(folder).seal()
    return folder


def cache_of(folder, line=9):
    """The cache files in a folder of a kernel that begins in a line of module.py."""
    return KernelCache(folder=folder, source="module", line=line)


def cache_files(folder):
    """Names of the index and of the files of machine code in a folder."""
    return sorted(file.name for file in folder.glob("*.nb?"))


def test_sealed_files_are_kept(sealed_folder):
    """An index and two files of machine code, as they were when the seal was written."""
    before = cache_files(sealed_folder)
    assert len(before) == 3
    assert cache_of(sealed_folder).remove_unless_intact()
    assert cache_files(sealed_folder) == before


@given(data=st.data())
def test_a_file_with_changed_bytes_is_removed(sealed_folder, tmp_path_factory, data):
    """In a copy of a sealed folder up to 64 bytes of a file, from a random one on, are changed: no file remains."""
    folder = shutil.copytree(sealed_folder, tmp_path_factory.mktemp("copy") / sealed_folder.name)
    file = data.draw(st.sampled_from(sorted(folder.iterdir())))
    content = bytearray(file.read_bytes())
    start = data.draw(st.integers(0, len(content) - 1))
    masks = data.draw(st.binary(min_size=1, max_size=64).filter(lambda masks: masks[0] != 0))
    for position, mask in zip(range(start, len(content)), masks, strict=False):
        content[position] ^= mask
    file.write_bytes(bytes(content))
    assert cache_of(folder).remove_unless_intact()
    assert cache_files(folder) == []


@pytest.mark.parametrize("length", [0, 1, 31, 100], ids="{} bytes".format)
@pytest.mark.parametrize("suffix", [".nbi", ".nbc", ".seal"])
def test_files_cut_short_are_removed(sealed_folder, tmp_path, suffix, length):
    """Only the first bytes remain of the index of a sealed kernel, of both files of its machine code,
    or of its seal.
    """
    folder = shutil.copytree(sealed_folder, tmp_path / sealed_folder.name)
    for file in folder.glob(f"*{suffix}"):
        file.write_bytes(file.read_bytes()[:length])
    assert cache_of(folder).remove_unless_intact()
    assert cache_files(folder) == []


@pytest.mark.parametrize("suffix", [".nbi", ".1.nbc", ".seal"])
def test_cache_that_lacks_a_file_is_removed_whole(sealed_folder, tmp_path, suffix):
    """Without its index, one of two files of machine code, or its seal, all files of the kernel go."""
    folder = shutil.copytree(sealed_folder, tmp_path / sealed_folder.name)
    (file,) = folder.glob(f"*{suffix}")
    file.unlink()
    assert cache_of(folder).remove_unless_intact()
    assert cache_files(folder) == []


def test_swapped_files_are_removed(sealed_folder, tmp_path):
    """The machine code of two signatures is sealed, but each file has the content of the other."""
    folder = shutil.copytree(sealed_folder, tmp_path / sealed_folder.name)
    first, second = folder.glob("*.nbc")
    content = first.read_bytes()
    first.write_bytes(second.read_bytes())
    second.write_bytes(content)
    assert cache_of(folder).remove_unless_intact()
    assert cache_files(folder) == []


def test_files_of_another_folder_are_removed(sealed_folder, tmp_path):
    """A seal names its folder, bvh, and this copy is in narrow."""
    folder = shutil.copytree(sealed_folder, tmp_path / "narrow")
    assert cache_of(folder).remove_unless_intact()
    assert cache_files(folder) == []


def test_only_files_of_the_damaged_kernel_are_removed(sealed_folder, tmp_path):
    """The kernel at line 9 is intact; the kernel at line 10 of the same module has an index that no seal covers."""
    folder = shutil.copytree(sealed_folder, tmp_path / sealed_folder.name)
    intact = cache_files(folder)
    unsealed = folder / f"module.other-10{cache_seals.PYTHON}.nbi"
    unsealed.write_bytes(b"of another kernel")
    assert cache_of(folder, line=9).remove_unless_intact()
    assert cache_files(folder) == sorted([*intact, unsealed.name])
    assert cache_of(folder, line=10).remove_unless_intact()
    assert cache_files(folder) == intact


@pytest.mark.parametrize("changed", ["sources", "numba"])
def test_changed_sources_or_numba_remove_every_kernel(sealed_folder, tmp_path, monkeypatch, changed):
    """A seal names the version of numba and a digest of all sources of kernels.

    The first query of a folder empties it, here for a kernel at line 11, of which there is no file.
    """
    folder = shutil.copytree(sealed_folder, tmp_path / sealed_folder.name)
    if changed == "sources":
        monkeypatch.setattr(cache_seals, "sources_digest", lambda: "another digest")
    else:
        monkeypatch.setattr(numba, "__version__", "0.0")
    assert cache_of(folder, line=11).remove_unless_intact()
    assert list(folder.iterdir()) == []


def test_source_digest_follows_text_and_not_file_times(tmp_path, monkeypatch):
    """Three files stand for the package's: a touched one changes nothing, one with another text the digest."""
    for name in ("kernels/compiling.py", "narrow/bvh/traverse.py", "numerics.py"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(f"# {name}")
    monkeypatch.setattr(cache_seals, "PACKAGE", tmp_path)
    digest_without_memory = cache_seals.sources_digest.__wrapped__
    before = digest_without_memory()
    (tmp_path / "numerics.py").touch()
    assert digest_without_memory() == before
    (tmp_path / "narrow" / "bvh" / "traverse.py").write_text("# changed")
    assert digest_without_memory() != before


def test_read_only_cache_is_used_only_while_intact(sealed_folder, tmp_path, monkeypatch):
    """No file can be removed: numba may load the intact files, and none once one of them is damaged."""
    folder = shutil.copytree(sealed_folder, tmp_path / sealed_folder.name)

    def refuse(*_, **__):
        raise PermissionError("read-only")

    monkeypatch.setattr("cdcore.kernels.cache_seals.Path.unlink", refuse)
    assert cache_of(folder).remove_unless_intact()
    _index, damaged, _intact = NAMES
    (folder / damaged.format(python=cache_seals.PYTHON)).write_bytes(b"damaged")
    assert not cache_of(folder).remove_unless_intact()


@pytest.mark.parametrize("suffix", ["nbi", "nbc", "seal"])
def test_a_damaged_kernel_is_compiled_again_and_kept(tmp_path, monkeypatch, suffix):
    """The same function is marked as a kernel three times, as three processes do; x * x + 7 is 11 for 2.

    After the first compiled it, a bit in the middle of a cache file is flipped: the second compiles it again, and the
    third loads what that left.
    """
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    first = kernel(square_plus_seven)
    assert first(2) == 11
    assert first.dispatcher.stats.cache_misses
    (file,) = tmp_path.rglob(f"*.{suffix}")
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 1
    file.write_bytes(bytes(content))
    second = kernel(square_plus_seven)
    assert second(2) == 11
    assert second.dispatcher.stats.cache_misses
    third = kernel(square_plus_seven)
    assert third(2) == 11
    assert third.dispatcher.stats.cache_hits
    assert not third.dispatcher.stats.cache_misses


def test_each_new_signature_is_sealed(tmp_path, monkeypatch):
    """A kernel of an int and of a float, x * x + 7: two signatures, of which the second renews the seal.

    Marked once more it stands for a second process, which loads the machine code of both.
    """
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    first = kernel(square_plus_seven)
    assert (first(2), first(2.0)) == (11, 11.0)
    second = kernel(square_plus_seven)
    assert (second(2), second(2.0)) == (11, 11.0)
    assert not second.dispatcher.stats.cache_misses


def test_a_second_process_waits_until_the_first_has_compiled(tmp_path):
    """A thread stands for the second process: it gets the lock after the first has given it back, 0.1 s later."""
    files, order = cache_of(tmp_path), []

    def second():
        with files.locked():
            order.append("second")

    with files.locked():
        thread = Thread(target=second)
        thread.start()
        thread.join(0.1)
        order.append("first")
    thread.join(10)
    assert order == ["first", "second"]


def test_two_kernels_of_one_module_are_locked_apart(tmp_path):
    """A kernel is known by its module and first line; a lock for both would make the second wait for the first."""
    with cache_of(tmp_path, line=9).locked(), cache_of(tmp_path, line=10).locked():
        assert len(list(tmp_path.glob("*.lock"))) == 2


def test_a_stopped_process_is_not_waited_for_forever(tmp_path, monkeypatch):
    """The lock is taken and never given back; the longest wait for it, two minutes, is cut to 0.05 s."""
    monkeypatch.setattr(cache_seals, "LONGEST_WAIT", 0.05)
    files, start = cache_of(tmp_path), monotonic()
    with files.locked(), files.locked():
        waited_s = monotonic() - start
    assert 0.05 < waited_s < 5.0


def test_a_folder_that_cannot_be_written_has_no_lock(tmp_path):
    """A file stands where the folder should be: work goes on without a lock, and no error comes."""
    (tmp_path / "file").write_text("")
    with cache_of(tmp_path / "file").locked():
        assert not list(tmp_path.rglob("*.lock"))
