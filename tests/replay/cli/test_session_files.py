"""Sessions by name and by folder."""

import pytest

from replay.api.remote_files import located
from replay.cli.session_files import session_files
from replay.errors import PlaceError


def test_a_folder_stands_for_its_session_files(tmp_path):
    for name in ("b.mcap", "a.mcap", "notes.csv"):
        (tmp_path / name).write_bytes(b"")
    assert session_files([tmp_path, tmp_path / "b.mcap"]) == [tmp_path / f"{name}.mcap" for name in "abb"]


def test_a_store_that_does_not_answer_is_a_sentence(monkeypatch):
    pytest.importorskip("upath")
    file = located("memory://class/one.mcap")
    monkeypatch.setattr(file.fs, "isdir", lambda path: 1 / 0)
    with pytest.raises(PlaceError, match=f"{file} cannot be reached"):
        session_files([file])
