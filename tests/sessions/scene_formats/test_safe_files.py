"""Files of a scene are read up to their limits of size, and XML only without a document type."""

import pytest

from sessions.errors import SceneSourceError
from sessions.scene_formats import safe_files
from sessions.scene_formats.safe_files import SceneFiles


@pytest.mark.parametrize("text", ["<!DOCTYPE scene><scene/>", "<scene><!ENTITY a 'b'></scene>"])
def test_document_type_or_entity_alone_is_refused(tmp_path, text):
    """A DOCTYPE before the first element, and an ENTITY inside it."""
    (tmp_path / "scene.xml").write_text(text)
    with pytest.raises(SceneSourceError, match="declares a document type or entities"):
        SceneFiles(tmp_path).xml(tmp_path / "scene.xml")


@pytest.mark.parametrize("limit", ["MOST_FILE_BYTES", "MOST_BYTES", "MOST_XML_BYTES"])
def test_file_is_read_up_to_its_limit_alone(tmp_path, monkeypatch, limit):
    """The file has 8 bytes; limits of a file, of all files and of XML are 8 and then 7."""
    path = tmp_path / "scene.xml"
    path.write_text("<scene/>")
    monkeypatch.setattr(safe_files, limit, 8)  # bytes of that text
    assert SceneFiles(tmp_path).xml(path).tag == "scene"
    monkeypatch.setattr(safe_files, limit, 7)
    with pytest.raises(SceneSourceError, match="0 MB"):
        SceneFiles(tmp_path).xml(path)


def test_elements_are_nested_up_to_their_limit(tmp_path, monkeypatch):
    """Three elements, each within the one before; the limit is 3 and then 2."""
    path = tmp_path / "scene.xml"
    path.write_text("<a><b><c/></b></a>")
    monkeypatch.setattr(safe_files, "MOST_DEPTH", 3)
    assert SceneFiles(tmp_path).xml(path).tag == "a"
    monkeypatch.setattr(safe_files, "MOST_DEPTH", 2)
    with pytest.raises(SceneSourceError, match="more than 2 elements within each other"):
        SceneFiles(tmp_path).xml(path)


def test_paths_lie_within_the_folder_and_exist(tmp_path):
    """Each path: whether it lies in the scene's folder, and whether something stands there."""
    folder = tmp_path / "scene"
    folder.mkdir()
    (folder / "cup.obj").touch()
    (tmp_path / "secret.obj").touch()
    (folder / "loop").symlink_to(folder / "loop")
    (folder / "link.obj").symlink_to(tmp_path / "secret.obj")
    files = SceneFiles(folder)
    expected = {
        "cup.obj": (True, True),
        "none.obj": (True, False),
        "../secret.obj": (False, True),
        "../none.obj": (False, False),
        "link.obj": (False, True),
        "loop": (False, False),
    }
    assert {name: (files.is_within(folder / name), files.exists(folder / name)) for name in expected} == expected
