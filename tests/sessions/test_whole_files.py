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


def listed_files(folder):
    """Names of files that may be replaced; refuses a folder that is not marked as its own."""
    if not (folder / "mark").is_file() and any(folder.iterdir()):
        raise RefusalError(f"{folder} is foreign")
    return ("table", "mark")


KILLED = """
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


def write(folder, word):
    """Write both files of a folder."""
    (folder / "table").write_text(word)
    (folder / "mark").write_text(word)


def test_last_writer_to_finish_determines_the_file(tmp_path):
    """Two write at the same time; the second closes first, so the file is the first writer's."""
    out = tmp_path / "out"
    with whole_file(out, RefusalError) as closed_last, whole_file(out, RefusalError) as closed_first:
        closed_last.write(b"last" * 9)
        closed_first.write(b"first")
    assert out.read_bytes() == b"last" * 9 and file_names(tmp_path) == ["out"]


def test_file_that_appears_meanwhile_is_replaced_only_on_request(tmp_path):
    """Without ``overwrite`` the other program's file stays, and no temporary file is left."""
    out = tmp_path / "out"
    with pytest.raises(RefusalError, match="was written by another program meanwhile; name another"):  # noqa: SIM117
        with whole_file(out, RefusalError, overwrite=False) as stream:
            stream.write(b"mine")
            out.write_bytes(b"theirs")
    assert out.read_bytes() == b"theirs" and file_names(tmp_path) == ["out"]


class Watched(type(Path())):
    """A place that is written only by who holds it to the end."""

    def replace(self, target):
        assert not is_abandoned(Path(self)), "another writer may remove it"
        return super().replace(target)


@pytest.mark.skipif(sys.platform == "win32", reason="there an open file takes no other name")
def test_written_file_is_locked_until_renamed_to_its_final_name(tmp_path):
    """``Watched`` is a path whose renaming fails once the lock of the temporary file is given up."""
    with whole_file(Watched(tmp_path / "out"), RefusalError) as stream:
        stream.write(b"all of it")
    assert (tmp_path / "out").read_bytes() == b"all of it"


@pytest.mark.skipif(sys.platform == "win32", reason="no file is locked there")
def test_only_files_that_nobody_holds_are_abandoned(tmp_path):
    """A link is abandoned even if the file it leads to is held; what is absent, or a folder, is not."""
    locked, link = tmp_path / "locked", tmp_path / "link"
    locked.touch()
    link.symlink_to(locked)
    with locked.open("rb") as stream:
        assert locks(stream)
        assert not is_abandoned(locked) and is_abandoned(link)
    assert is_abandoned(locked)
    assert not is_abandoned(tmp_path / "none") and not is_abandoned(tmp_path)


class Swept(type(Path())):
    """A place whose first file another writer removes before it is held."""

    removed = False

    def open(self, *how):
        stream = super().open(*how)
        if not Swept.removed:
            Swept.removed = True
            self.unlink()
        return stream


def test_temporary_file_removed_before_locking_is_created_again(tmp_path):
    """``Swept`` is a path whose first temporary file another writer removes at once."""
    with whole_file(Swept(tmp_path / "out"), RefusalError) as stream:
        stream.write(b"all of it")
    assert (tmp_path / "out").read_bytes() == b"all of it"


def test_no_link_is_followed(tmp_path):
    """Links to a precious file have the names that a writer uses: they are replaced, the file is not written."""
    (tmp_path / "precious").write_text("thesis")
    for name in ("out.writing", ".out.partial", ".out.12345678.partial", "out"):
        (tmp_path / name).symlink_to(tmp_path / "precious")
    with whole_file(tmp_path / "out", RefusalError) as stream:
        stream.write(b"new")
    assert (tmp_path / "precious").read_text() == "thesis" and (tmp_path / "out").read_text() == "new"
    assert not (tmp_path / "out").is_symlink()


def test_twelve_writers_leave_a_single_complete_folder(tmp_path):
    """They write at one time: one ends, the others are refused, and both files are of the one."""
    out, ends = tmp_path / "out", []
    begin = threading.Barrier(12)

    def overwrite(word):
        try:
            with whole_folder(out, RefusalError) as folder:
                write(folder, word)
                begin.wait()
            ends.append(word)
        except RefusalError as error:
            assert "another program" in str(error)

    threads = [threading.Thread(target=overwrite, args=(str(k),)) for k in range(12)]
    [thread.start() for thread in threads]
    [thread.join() for thread in threads]
    assert len(ends) == 1 and (out / "table").read_text() == (out / "mark").read_text() == ends[0]
    assert file_names(tmp_path) == ["out"]


def test_replacing_a_folder_removes_only_files_it_lists(tmp_path):
    """The second writer replaces files of the first and keeps the user's; a folder without its mark is foreign."""
    out = tmp_path / "out"
    for word in ("first", "second"):
        with whole_folder(out, RefusalError, listed_files) as folder:
            write(folder, word)
        (out / f"{word}.txt").write_text("mine")
    assert file_names(out) == ["first.txt", "mark", "second.txt", "table"] and (out / "mark").read_text() == "second"
    (out / "mark").unlink()
    with pytest.raises(RefusalError, match="is foreign"), whole_folder(out, RefusalError, listed_files) as folder:
        write(folder, "third")
    assert file_names(tmp_path) == ["out"] and (out / "table").read_text() == "second"


@pytest.mark.skipif(sys.platform == "win32", reason="no signal kills there")
@pytest.mark.parametrize("moment", ["before the first rename", "between two renames"])
def test_next_writer_removes_leftovers_of_killed_writers_only(tmp_path, moment):
    """A writer is killed while it renames; of two that live, neither removes the other's folder."""
    out = tmp_path / "out"
    with whole_folder(out, RefusalError, listed_files) as folder:
        write(folder, "first")
    (out / "note").write_text("mine")
    program = KILLED.format(out=str(out), moment=moment)
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == -9
    assert len(file_names(tmp_path)) == 3  # a lock, the new folder, the old one or what was set aside
    with whole_folder(out, RefusalError, listed_files) as living:
        with whole_folder(out, RefusalError, listed_files) as folder:
            write(folder, "second")
        assert living.is_dir()
        write(living, "third")
    assert file_names(tmp_path) == ["out"] and file_names(out) == ["mark", "note", "table"]
    assert (out / "mark").read_text() == "third" and (out / "note").read_text() == "mine"


def test_unwritable_path_is_refused_in_a_sentence(tmp_path):
    """A path below a file, a name of 300 letters, and a full disk; the file that was there stays."""
    (tmp_path / "file").write_text("")
    for target in (tmp_path / "file" / "out", tmp_path / ("x" * 300)):
        with pytest.raises(RefusalError, match="cannot be written"), whole_file(target, RefusalError):
            pass
    # A full disk is no other program, also where there is a file already.
    with pytest.raises(RefusalError, match=r"cannot be written .No space"), whole_file(tmp_path / "file", RefusalError):
        raise OSError(28, "No space left")
    assert file_names(tmp_path) == ["file"]
