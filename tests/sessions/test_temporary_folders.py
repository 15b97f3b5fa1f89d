"""Temporary folders: gone with their block, and removed by the next program where their own was killed."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from sessions import temporary_folders
from sessions.temporary_folders import IN_USE, remove_leftovers, temporary_folder

KILLED = """
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


def killed_owner(temp):
    """The folder that a killed program left."""
    subprocess.run([sys.executable, "-c", KILLED, str(temp)], check=False)
    (left,) = temp.iterdir()
    return left


@pytest.mark.parametrize("ending", [None, ValueError, KeyboardInterrupt])
def test_a_temporary_folder_is_gone_after_its_block(temp, ending):
    """The block ends by itself, by an error or by an interrupt; the folder holds a file."""
    try:
        with temporary_folder() as folder:
            assert file_names(folder) == [] and temp in folder.parents
            (folder / "a").write_text("b")
            if ending:
                raise ending
    except (ValueError, KeyboardInterrupt):
        assert ending
    assert file_names(temp) == []


def test_next_program_removes_leftovers_of_a_killed_program(temp):
    """The killed program left a half written file; the next folder that is made removes all of it."""
    left = killed_owner(temp)
    assert (left / "files" / "pictures" / "run.rrd").exists()
    with temporary_folder() as folder:
        assert file_names(temp) == [folder.parent.name] and not left.exists()


@pytest.mark.skipif(sys.platform == "win32", reason="no other user there")
def test_leftover_folder_of_another_user_is_not_removed(temp, monkeypatch):
    """This process takes another user's number than that of the folder, and then its own again."""
    left = killed_owner(temp)
    with monkeypatch.context() as another_user:
        another_user.setattr(os, "getuid", lambda: left.stat().st_uid + 1)
        remove_leftovers()
        assert left.exists()
    remove_leftovers()
    assert not left.exists()


def test_folders_in_use_and_foreign_folders_stay(temp):
    """Foreign are a folder and a file with the names of leftovers, and links to folders in use or elsewhere."""
    (temp / "replay-notes").mkdir()
    (temp / "replay-notes" / "thesis.txt").write_text("three years")
    (temp / "replay-file").write_text("a file")
    with temporary_folder() as first, temporary_folder() as second:
        assert first.exists() and second.exists()
        (temp / "replay-link").symlink_to(first.parent, target_is_directory=True)
        remove_leftovers()
        assert first.exists() and second.exists() and (temp / "replay-link").is_symlink()
    (temp / "elsewhere").mkdir()
    (temp / "elsewhere" / IN_USE).touch()  # nobody holds it, but only a link to its folder has the name of a leftover
    (temp / "replay-elsewhere").symlink_to(temp / "elsewhere", target_is_directory=True)
    remove_leftovers()
    assert file_names(temp) == ["elsewhere", "replay-elsewhere", "replay-file", "replay-link", "replay-notes"]
    assert file_names(temp / "elsewhere") == [IN_USE]


NO_OPEN_FILE_IS_REMOVED = pytest.mark.skipif(sys.platform == "win32", reason="no open file is removed there")


@pytest.mark.parametrize("is_removed", [False, pytest.param(True, marks=NO_OPEN_FILE_IS_REMOVED)])
def test_folder_removed_before_its_lock_is_remade(temp, monkeypatch, is_removed):
    """Another program holds the first lock file, or removed it before it was locked; nobody takes the second."""
    lock_files = []

    def locks(stream):
        lock_files.append(Path(stream.name))
        if is_removed and len(lock_files) == 1:
            lock_files[0].unlink()
        return is_removed or len(lock_files) == 2

    monkeypatch.setattr(temporary_folders, "locks", locks)
    with temporary_folder() as folder:
        assert lock_files[1:] == [folder.parent / IN_USE] and file_names(temp) == [folder.parent.name]
    assert file_names(temp) == []
