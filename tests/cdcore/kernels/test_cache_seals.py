"""Cache files of a kernel: whole ones are loaded, anything else is removed and compiled again."""

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
def verified_anew():
    """Folders are looked through for outdated files once a process; here once a test."""
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
    """A folder with two signatures of one kernel, sealed."""
    folder = tmp_path_factory.mktemp("module") / "bvh"
    folder.mkdir()
    for number, name in enumerate(NAMES):
        (folder / name.format(python=cache_seals.PYTHON)).write_bytes(b"content %d" % number * 99)
    cache_of(folder).seal()
    return folder


def cache_of(folder, line=9):
    """The cache files in a folder of a kernel that begins in a line of module.py."""
    return KernelCache(folder=folder, source="module", line=line)


def machine_code(folder):
    """Names of the files of machine code in a folder."""
    return sorted(file.name for file in folder.glob("*.nb?"))


def test_sealed_files_are_kept(sealed_folder):
    """``remove_unless_intact`` returns whether numba may load from the folder: whole files, or none at all."""
    before = machine_code(sealed_folder)
    assert cache_of(sealed_folder).remove_unless_intact() and machine_code(sealed_folder) == before
    assert len(before) == len(NAMES)


@given(data=st.data())
def test_a_file_with_changed_bytes_is_removed(sealed_folder, tmp_path_factory, data):
    """Up to 64 bytes of a sealed file are flipped from a random one on; an unchanged file must stay."""
    folder = shutil.copytree(sealed_folder, tmp_path_factory.mktemp("copy") / sealed_folder.name)
    file = data.draw(st.sampled_from(sorted(folder.iterdir())))
    content = bytearray(file.read_bytes())
    start = data.draw(st.integers(0, len(content) - 1))
    change = data.draw(st.binary(min_size=1, max_size=64).filter(any))
    for position, mask in zip(range(start, len(content)), change, strict=False):
        content[position] ^= mask
    changed = bytes(content) != file.read_bytes()
    file.write_bytes(bytes(content))
    assert cache_of(folder).remove_unless_intact()
    assert (machine_code(folder) == []) == changed


@pytest.mark.parametrize("length", [0, 1, 31, 100])
@pytest.mark.parametrize("suffix", [".nbi", ".nbc", ".seal"])
def test_files_cut_short_are_removed(sealed_folder, tmp_path, suffix, length):
    """Index, machine code and seal of a cache; with any of them damaged nothing may be loaded."""
    folder = shutil.copytree(sealed_folder, tmp_path / sealed_folder.name)
    for file in folder.glob(f"*{suffix}"):
        file.write_bytes(file.read_bytes()[:length])
    assert cache_of(folder).remove_unless_intact() and machine_code(folder) == []


@pytest.mark.parametrize("suffix", [".nbi", ".1.nbc", ".seal"])
def test_cache_that_lacks_a_file_is_removed_whole(sealed_folder, tmp_path, suffix):
    """Without its index, one of two files of machine code, or its seal, all files of the kernel go."""
    folder = shutil.copytree(sealed_folder, tmp_path / sealed_folder.name)
    for file in folder.glob(f"*{suffix}"):
        file.unlink()
    assert cache_of(folder).remove_unless_intact() and machine_code(folder) == []


def test_swapped_files_are_removed(sealed_folder, tmp_path):
    """Both files are sealed, each under the name of the other."""
    folder = shutil.copytree(sealed_folder, tmp_path / sealed_folder.name)
    first, second = folder.glob("*.nbc")
    content = first.read_bytes()
    first.write_bytes(second.read_bytes())
    second.write_bytes(content)
    assert cache_of(folder).remove_unless_intact() and machine_code(folder) == []


def test_files_of_another_folder_are_removed(sealed_folder, tmp_path):
    """A seal names its folder, bvh, and this copy is in narrow."""
    folder = shutil.copytree(sealed_folder, tmp_path / "narrow")
    assert cache_of(folder).remove_unless_intact() and machine_code(folder) == []


def test_only_files_of_the_damaged_kernel_are_removed(sealed_folder, tmp_path):
    """The kernel at line 9 is intact; the kernel at line 10 has a file that no seal covers."""
    folder = shutil.copytree(sealed_folder, tmp_path / sealed_folder.name)
    other = folder / f"module.other-10{cache_seals.PYTHON}.nbi"
    other.write_bytes(b"of another kernel")
    assert cache_of(folder).remove_unless_intact() and len(machine_code(folder)) == len(NAMES) + 1
    assert cache_of(folder, line=10).remove_unless_intact() and not other.exists()


@pytest.mark.parametrize("changed", ["sources", "numba"])
def test_changed_sources_or_numba_remove_every_kernel(sealed_folder, tmp_path, monkeypatch, changed):
    """Line 11 has no kernel; the first look at the folder empties it all the same."""
    folder = shutil.copytree(sealed_folder, tmp_path / sealed_folder.name)
    if changed == "sources":
        monkeypatch.setattr(cache_seals, "sources_digest", lambda: "other")
    else:
        monkeypatch.setattr(numba, "__version__", "0.0")
    assert cache_of(folder, line=11).remove_unless_intact()
    assert list(folder.iterdir()) == []


def test_source_digest_follows_text_and_not_file_times(tmp_path, monkeypatch):
    """Three files stand for the package: a touched one changes nothing, a changed one the digest."""
    for name in ("kernels/compiling.py", "narrow/bvh/traverse.py", "numerics.py"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(f"# {name}")
    monkeypatch.setattr(cache_seals, "PACKAGE", tmp_path)
    digest = cache_seals.sources_digest.__wrapped__
    before = digest()
    (tmp_path / "numerics.py").touch()
    assert digest() == before
    (tmp_path / "narrow" / "bvh" / "traverse.py").write_text("# changed")
    assert digest() != before


def test_read_only_cache_is_used_only_while_intact(sealed_folder, tmp_path, monkeypatch):
    """``remove_unless_intact`` returns whether numba may load the compiled files that are left in the folder."""
    folder = shutil.copytree(sealed_folder, tmp_path / sealed_folder.name)

    def refuse(*_, **__):
        raise PermissionError("read-only")

    monkeypatch.setattr("cdcore.kernels.cache_seals.Path.unlink", refuse)
    assert cache_of(folder).remove_unless_intact()
    damaged_file = folder / NAMES[1].format(python=cache_seals.PYTHON)
    damaged_file.write_bytes(b"damaged")
    assert not cache_of(folder).remove_unless_intact()


@pytest.mark.parametrize("kind", ["nbi", "nbc", "seal"])
def test_a_damaged_kernel_is_compiled_again_and_kept(tmp_path, monkeypatch, kind):
    """A bit in the middle of the file is flipped: the second kernel compiles, the third loads what it left."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    first = kernel(square_plus_seven)
    assert first(2) == 11 and first.dispatcher.stats.cache_misses
    (file,) = tmp_path.rglob(f"*.{kind}")
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 1
    file.write_bytes(bytes(content))
    second = kernel(square_plus_seven)
    assert second(2) == 11 and second.dispatcher.stats.cache_misses
    third = kernel(square_plus_seven)
    assert third(2) == 11 and third.dispatcher.stats.cache_hits and not third.dispatcher.stats.cache_misses


def test_each_new_signature_is_sealed(tmp_path, monkeypatch):
    """An int and a float are two signatures; both are loaded the second time."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    first = kernel(square_plus_seven)
    assert (first(2), first(2.0)) == (11, 11.0)
    again = kernel(square_plus_seven)
    assert (again(2), again(2.0)) == (11, 11.0) and not again.dispatcher.stats.cache_misses


def test_a_second_process_waits_until_the_first_has_compiled(tmp_path):
    """A thread stands for the second process: within 0.1 s it does not get the lock."""
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
    """The same lock is taken twice; waiting is cut to 0.05 s."""
    monkeypatch.setattr(cache_seals, "LONGEST_WAIT", 0.05)
    files, start = cache_of(tmp_path), monotonic()
    with files.locked(), files.locked():
        assert monotonic() - start < 5.0


def test_a_folder_that_cannot_be_written_has_no_lock(tmp_path):
    """A file stands where the folder should be: work goes on without a lock, and no error comes."""
    (tmp_path / "file").write_text("")
    with cache_of(tmp_path / "file").locked():
        assert not list(tmp_path.rglob("*.lock"))
