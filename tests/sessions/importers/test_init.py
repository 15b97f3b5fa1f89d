import pytest

from sessions.errors import ImportFileError
from sessions.importers import IMPORTERS, import_session


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
