import subprocess
import sys
import threading
from pathlib import Path

import pytest

from sessions.whole_files import is_abandoned, locks, whole_file, whole_folder


class RefusalError(Exception):
    pass


def file_names(folder):
    """Names of what is in a folder, sorted."""
    return sorted(path.name for path in folder.iterdir())


def replaceable_files(folder):
    """Names of the files that a writer may replace; refuses a folder with files but without its "mark"."""
    if not (folder / "mark").is_file() and any(folder.iterdir()):
        raise RefusalError(f"{folder} is foreign")
    return ("table", "mark")


PROGRAM_THAT_KILLS_ITSELF = """
import os
from pathlib import Path
from sessions.whole_files import whole_folder

rename = Path.rename

def once(self, to):
    rename(self, to)
    os.kill(os.getpid(), 9)

if "{moment}" == "between two renames":
    Path.rename = once
with whole_folder(Path("{out}"), OSError, lambda _: ("table", "mark")) as folder:
    (folder / "table").write_text("torn")
    if "{moment}" == "before the first rename":
        os.kill(os.getpid(), 9)
"""


def write_both_files(folder, word):
    """Writes the files "table" and "mark" of a folder, each with this word."""
    (folder / "table").write_text(word)
    (folder / "mark").write_text(word)


def test_last_writer_to_finish_determines_the_file(tmp_path):
    """Two write one file at the same time; the second closes first, so that the file is the first writer's.

    No temporary file is left.
    """
    out = tmp_path / "out"
    with whole_file(out, RefusalError) as closed_last, whole_file(out, RefusalError) as closed_first:
        closed_last.write(b"the longer text, closed last")
        closed_first.write(b"closed first")
    assert out.read_bytes() == b"the longer text, closed last"
    assert file_names(tmp_path) == ["out"]


def test_file_that_appears_meanwhile_is_replaced_only_on_request(tmp_path):
    """Another program writes the file while it is being written; without ``overwrite`` its file stays.

    No temporary file is left.
    """
    out = tmp_path / "out"
    with pytest.raises(RefusalError, match="was written by another program meanwhile; name another"):  # noqa: SIM117
        with whole_file(out, RefusalError, overwrite=False) as stream:
            stream.write(b"mine")
            out.write_bytes(b"another program's")
    assert out.read_bytes() == b"another program's"
    assert file_names(tmp_path) == ["out"]


class PathLockedWhileRenamed(type(Path())):
    """A path that fails where it is renamed while nobody has a lock on it: another writer could remove it."""

    def replace(self, target):
        assert not is_abandoned(Path(self)), "another writer may remove it"
        return super().replace(target)


@pytest.mark.skipif(sys.platform == "win32", reason="there an open file takes no other name")
def test_written_file_is_locked_until_renamed_to_its_final_name(tmp_path):
    """The file is written under a temporary name, which it must not lose before its lock."""
    with whole_file(PathLockedWhileRenamed(tmp_path / "out"), RefusalError) as stream:
        stream.write(b"all of it")
    assert (tmp_path / "out").read_bytes() == b"all of it"


@pytest.mark.skipif(sys.platform == "win32", reason="no file is locked there")
def test_only_files_that_nobody_holds_are_abandoned(tmp_path):
    """An abandoned file may be removed: a file without a lock, and a link, even to a locked file.

    What is absent, and a folder, is not abandoned.
    """
    locked, link = tmp_path / "locked", tmp_path / "link"
    locked.touch()
    link.symlink_to(locked)
    with locked.open("rb") as stream:
        assert locks(stream)
        assert not is_abandoned(locked)
        assert is_abandoned(link)
    assert is_abandoned(locked)  # closing it gave the lock up
    assert not is_abandoned(tmp_path / "none")
    assert not is_abandoned(tmp_path)


class PathRemovedWhenFirstOpened(type(Path())):
    """A path whose first file is removed right after it is opened, as by another writer that cleans up."""

    removed = False

    def open(self, *how):
        stream = super().open(*how)
        if not PathRemovedWhenFirstOpened.removed:
            PathRemovedWhenFirstOpened.removed = True
            self.unlink()
        return stream


def test_temporary_file_removed_before_locking_is_created_again(tmp_path):
    """Another writer removes the temporary file between its creation and its lock."""
    with whole_file(PathRemovedWhenFirstOpened(tmp_path / "out"), RefusalError) as stream:
        stream.write(b"all of it")
    assert PathRemovedWhenFirstOpened.removed
    assert (tmp_path / "out").read_bytes() == b"all of it"


def test_no_link_is_followed(tmp_path):
    """Links to a precious file have the names that a writer uses: "out" is replaced, the file is not written."""
    (tmp_path / "precious").write_text("thesis")
    for name in ("out.writing", ".out.partial", ".out.12345678.partial", "out"):
        (tmp_path / name).symlink_to(tmp_path / "precious")
    with whole_file(tmp_path / "out", RefusalError) as stream:
        stream.write(b"new")
    assert (tmp_path / "precious").read_text() == "thesis"
    assert (tmp_path / "out").read_text() == "new"
    assert not (tmp_path / "out").is_symlink()


def test_twelve_writers_leave_a_single_complete_folder(tmp_path):
    """Twelve threads write the same folder and end at the same time: eleven are refused.

    Both files of the folder are those of the writer that was not, and no temporary folder is left.
    """
    writers = 12
    out, finished = tmp_path / "out", []
    all_have_written = threading.Barrier(writers)

    def write_folder(word):
        try:
            with whole_folder(out, RefusalError) as folder:
                write_both_files(folder, word)
                all_have_written.wait()
            finished.append(word)
        except RefusalError as error:
            assert "another program" in str(error)

    threads = [threading.Thread(target=write_folder, args=(str(k),)) for k in range(writers)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [(out / "table").read_text()] == finished
    assert [(out / "mark").read_text()] == finished
    assert file_names(tmp_path) == ["out"]


def test_replacing_a_folder_removes_only_files_it_lists(tmp_path):
    """A folder is written twice, and the user puts a file into it after each: only "table" and "mark" are replaced."""
    out = tmp_path / "out"
    for word in ("first", "second"):
        with whole_folder(out, RefusalError, replaceable_files) as folder:
            write_both_files(folder, word)
        (out / f"{word}.txt").write_text("the user's")
    assert file_names(out) == ["first.txt", "mark", "second.txt", "table"]
    assert (out / "mark").read_text() == "second"


def test_folder_that_its_owner_refuses_is_not_replaced(tmp_path):
    """The folder has a table and no mark, so that ``replaceable_files`` raises: the table stays."""
    out = tmp_path / "out"
    out.mkdir()
    (out / "table").write_text("old")
    with pytest.raises(RefusalError, match="is foreign"), whole_folder(out, RefusalError, replaceable_files) as folder:
        write_both_files(folder, "new")
    assert (out / "table").read_text() == "old"
    assert file_names(tmp_path) == ["out"]


@pytest.mark.skipif(sys.platform == "win32", reason="no signal kills there")
@pytest.mark.parametrize("moment", ["before the first rename", "between two renames"])
def test_next_writer_removes_leftovers_of_killed_writers_only(tmp_path, moment):
    """A folder is there, with a note of the user's; a program that replaces it is killed and leaves its own behind.

    Then two write at once: the one that ends first removes what the killed one left, and not the other's folder.
    """
    out = tmp_path / "out"
    with whole_folder(out, RefusalError, replaceable_files) as folder:
        write_both_files(folder, "first")
    (out / "note").write_text("the user's")
    program = PROGRAM_THAT_KILLS_ITSELF.format(out=str(out), moment=moment)
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == -9
    assert len(file_names(tmp_path)) == 3  # a lock, the new folder, and the old folder or where it was moved to

    with whole_folder(out, RefusalError, replaceable_files) as ends_last:
        with whole_folder(out, RefusalError, replaceable_files) as ends_first:
            write_both_files(ends_first, "second")
        assert ends_last.is_dir()
        write_both_files(ends_last, "third")
    assert file_names(tmp_path) == ["out"]
    assert file_names(out) == ["mark", "note", "table"]
    assert (out / "mark").read_text() == "third"
    assert (out / "note").read_text() == "the user's"


def test_unwritable_path_is_refused_in_a_sentence(tmp_path):
    """A path below a file, which is no folder, and a name of 300 letters, more than file systems have."""
    (tmp_path / "file").write_text("")
    for target in (tmp_path / "file" / "out", tmp_path / ("x" * 300)):
        with pytest.raises(RefusalError, match="cannot be written"), whole_file(target, RefusalError):
            pass


def test_full_disk_is_named_and_leaves_the_old_file(tmp_path):
    """The system has no space while a file is replaced: the error does not blame another program."""
    (tmp_path / "file").write_text("old")
    with pytest.raises(RefusalError, match=r"cannot be written .No space"), whole_file(tmp_path / "file", RefusalError):
        raise OSError(28, "No space left")
    assert (tmp_path / "file").read_text() == "old"
    assert file_names(tmp_path) == ["file"]
