"""Temporary folders: gone with their block, and removed by the next program where their own was killed."""

import os
import subprocess
import sys
import tempfile
from contextlib import nullcontext
from pathlib import Path

import pytest

from sessions import temporary_folders
from sessions.temporary_folders import IN_USE, remove_leftovers, temporary_folder

PROGRAM_THAT_ENDS_WITHIN = """
import os, sys, tempfile
tempfile.tempdir = sys.argv[1]
from sessions.temporary_folders import temporary_folder
with temporary_folder() as folder:
    (folder / "pictures").mkdir()
    (folder / "pictures" / "run.rrd").write_bytes(b"half")
    os._exit(9)
"""


@pytest.fixture
def temp(tmp_path, monkeypatch):
    """The folder for temporary files, empty."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def file_names(folder):
    """Names of what is in a folder, sorted."""
    return sorted(entry.name for entry in folder.iterdir())


def leftover_of_a_killed_program(temp):
    """The folder that a program left when it ended within the block of its temporary folder."""
    subprocess.run([sys.executable, "-c", PROGRAM_THAT_ENDS_WITHIN, str(temp)], check=False)
    (leftover,) = temp.iterdir()
    return leftover


@pytest.mark.parametrize("ending", [None, ValueError, KeyboardInterrupt])
def test_a_temporary_folder_is_gone_after_its_block(temp, ending):
    """The folder holds a file when its block ends: by itself (None), by an error or by an interrupt."""
    expected_end = pytest.raises(ending) if ending else nullcontext()
    with expected_end, temporary_folder() as folder:
        assert temp in folder.parents
        assert file_names(folder) == []
        (folder / "a").write_text("b")
        if ending:
            raise ending
    assert file_names(temp) == []


def test_next_program_removes_leftovers_of_a_killed_program(temp):
    """The killed program left a half written file; the next folder that is made removes all of it."""
    leftover = leftover_of_a_killed_program(temp)
    assert (leftover / "files" / "pictures" / "run.rrd").exists()
    with temporary_folder() as folder:
        assert file_names(temp) == [folder.parent.name]
        assert folder.parent != leftover


@pytest.mark.skipif(sys.platform == "win32", reason="no other user there")
def test_leftover_folder_of_another_user_is_not_removed(temp, monkeypatch):
    """This process first takes another user's number than that of the folder, and then its own again."""
    leftover = leftover_of_a_killed_program(temp)
    with monkeypatch.context() as another_user:
        another_user.setattr(os, "getuid", lambda: leftover.stat().st_uid + 1)
        remove_leftovers()
        assert leftover.exists()
    remove_leftovers()
    assert not leftover.exists()


def test_folders_in_use_stay(temp):
    """Two temporary folders are within their blocks while leftovers are removed, and a link leads to the first."""
    with temporary_folder() as first, temporary_folder() as second:
        (temp / "replay-link").symlink_to(first.parent, target_is_directory=True)
        remove_leftovers()
        assert first.exists()
        assert second.exists()
        assert (temp / "replay-link").is_symlink()


def test_foreign_files_and_folders_stay(temp):
    """A file, a folder of notes, and two links have names as leftovers have, replay-...: none is of this program.

    A link leads nowhere, the other to a folder with a lock file that nobody has locked, as a leftover has.
    """
    (temp / "replay-nowhere").symlink_to(temp / "absent", target_is_directory=True)
    (temp / "replay-file").write_text("a file")
    (temp / "replay-notes").mkdir()
    (temp / "replay-notes" / "thesis.txt").write_text("three years")
    (temp / "elsewhere").mkdir()
    (temp / "elsewhere" / IN_USE).touch()
    (temp / "replay-elsewhere").symlink_to(temp / "elsewhere", target_is_directory=True)
    remove_leftovers()
    assert file_names(temp) == ["elsewhere", "replay-elsewhere", "replay-file", "replay-notes", "replay-nowhere"]
    assert file_names(temp / "elsewhere") == [IN_USE]
    assert file_names(temp / "replay-notes") == ["thesis.txt"]


NO_OPEN_FILE_IS_REMOVED = pytest.mark.skipif(sys.platform == "win32", reason="no open file is removed there")


@pytest.mark.parametrize("is_removed", [False, pytest.param(True, marks=NO_OPEN_FILE_IS_REMOVED)])
def test_folder_removed_before_its_lock_is_remade(temp, monkeypatch, is_removed):
    """Another program locks the first lock file, or (``is_removed``) removes it before it is locked.

    Then a second folder is made, with a lock file that nobody takes, and only this one is there.
    """
    lock_files = []

    def locks(stream):
        lock_files.append(Path(stream.name))
        if is_removed and len(lock_files) == 1:
            lock_files[0].unlink()
        return is_removed or len(lock_files) == 2

    monkeypatch.setattr(temporary_folders, "locks", locks)
    with temporary_folder() as folder:
        _first_lock_file, *later_lock_files = lock_files
        assert later_lock_files == [folder.parent / IN_USE]
        assert file_names(temp) == [folder.parent.name]
    assert file_names(temp) == []
