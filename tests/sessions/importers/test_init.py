import sys
from importlib.metadata import EntryPoint, EntryPoints

import pytest

from sessions import importers
from sessions.errors import ImportFileError
from sessions.importers import ENTRY_POINT_GROUP, IMPORTERS, import_session, importer_names


def test_an_unknown_format_names_those_there_are(tmp_path):
    with pytest.raises(ImportFileError, match="no importer 'unity'; there are: aframe, csv"):
        import_session("unity", tmp_path / "x")


@pytest.mark.parametrize("name", IMPORTERS)
def test_an_unknown_option_names_those_there_are(name, tmp_path):
    with pytest.raises(ImportFileError, match=r"has no option 'colour'; it has: .*meshes"):
        import_session(name, tmp_path / "x", colour=1)


@pytest.mark.parametrize("name", IMPORTERS)
def test_a_missing_file_and_a_folder_are_refused(name, tmp_path):
    for path in (tmp_path / "absent", tmp_path):
        with pytest.raises(ImportFileError, match="does not exist or is no file"):
            import_session(name, path)


def read_outside(source, *, answer="read"):
    return answer


@pytest.fixture
def outside(monkeypatch):
    """Two importers of other packages: one that works and one that cannot be loaded."""
    points = EntryPoints(
        [
            EntryPoint("outside", "sessions.importers.from_outside:read_outside", ENTRY_POINT_GROUP),
            EntryPoint("broken", "sessions.importers.absent:read", ENTRY_POINT_GROUP),
            EntryPoint("csv", "sessions.importers.absent:read", ENTRY_POINT_GROUP),
        ]
    )
    module = type(sys)("sessions.importers.from_outside")
    module.read_outside = read_outside
    monkeypatch.setitem(sys.modules, "sessions.importers.from_outside", module)
    monkeypatch.setattr(importers, "entry_points", lambda **wanted: points.select(**wanted))


def test_an_importer_of_another_package_is_a_row_like_any_other(outside, tmp_path):
    (tmp_path / "x").touch()
    assert importer_names() == [*IMPORTERS, "broken", "outside"]
    assert import_session("outside", tmp_path / "x", answer="found") == "found"
    with pytest.raises(ImportFileError, match="has no option 'colour'; it has: answer"):
        import_session("outside", tmp_path / "x", colour=1)


def test_an_importer_that_cannot_be_loaded_is_one_sentence_and_hides_no_built_in(outside, tmp_path):
    with pytest.raises(ImportFileError, match=r"importer 'broken' \(sessions.importers.absent:read\) cannot be loaded"):
        import_session("broken", tmp_path / "x")
    with pytest.raises(ImportFileError, match="does not exist or is no file"):
        import_session("csv", tmp_path / "x")
