"""Files of a scene are read up to their limits of size, and XML only without a document type."""

import pytest

from sessions.errors import SceneSourceError
from sessions.scene_formats import safe_files
from sessions.scene_formats.safe_files import SceneFiles


@pytest.mark.parametrize(
    "text",
    [
        pytest.param("<!DOCTYPE scene><scene/>", id="document type"),
        pytest.param("<scene><!ENTITY a 'b'></scene>", id="entity"),
    ],
)
def test_document_type_or_entity_alone_is_refused(tmp_path, text):
    """A DOCTYPE before the first element, and an ENTITY inside it: by either, XML can read files or fill the memory."""
    (tmp_path / "scene.xml").write_text(text)
    with pytest.raises(SceneSourceError, match="declares a document type or entities"):
        SceneFiles(tmp_path).xml(tmp_path / "scene.xml")


@pytest.mark.parametrize(
    ("limit", "refusal"),
    [
        ("MOST_FILE_BYTES", "has 0 MB, more than 0 MB; reduce it"),
        ("MOST_BYTES", "have more than 0 MB; reduce the scene"),
        ("MOST_XML_BYTES", "has 0 MB of XML"),
    ],
)
def test_file_is_read_up_to_its_limit_alone(tmp_path, monkeypatch, limit, refusal):
    """A file of 8 bytes is read with a limit of 8 and refused with one of 7: of a file, of all files, or of XML.

    The refusal says the limit in megabytes, here 0.
    """
    path = tmp_path / "scene.xml"
    path.write_text("<scene/>")
    monkeypatch.setattr(safe_files, limit, 8)
    assert SceneFiles(tmp_path).xml(path).tag == "scene"
    monkeypatch.setattr(safe_files, limit, 7)
    with pytest.raises(SceneSourceError, match=refusal):
        SceneFiles(tmp_path).xml(path)


def test_elements_are_nested_up_to_their_limit(tmp_path, monkeypatch):
    """An XML file has three elements, each within the one before; the limit is 3 and then 2."""
    path = tmp_path / "scene.xml"
    path.write_text("<a><b><c/></b></a>")
    monkeypatch.setattr(safe_files, "MOST_DEPTH", 3)
    assert SceneFiles(tmp_path).xml(path).tag == "a"
    monkeypatch.setattr(safe_files, "MOST_DEPTH", 2)
    with pytest.raises(SceneSourceError, match="more than 2 elements within each other"):
        SceneFiles(tmp_path).xml(path)


@pytest.mark.parametrize(
    ("name", "is_within", "exists"),
    [
        pytest.param("cup.obj", True, True, id="a file"),
        pytest.param("none.obj", True, False, id="no file"),
        pytest.param("../secret.obj", False, True, id="a file outside"),
        pytest.param("../none.obj", False, False, id="no file outside"),
        pytest.param("link.obj", False, True, id="a link to a file outside"),
        pytest.param("loop", False, False, id="a link to itself"),
    ],
)
def test_paths_lie_within_the_folder_and_exist(tmp_path, name, is_within, exists):
    """``name``: a path from the scene's folder on; secret.obj stands beside the folder."""
    folder = tmp_path / "scene"
    folder.mkdir()
    (folder / "cup.obj").touch()
    (tmp_path / "secret.obj").touch()
    (folder / "loop").symlink_to(folder / "loop")
    (folder / "link.obj").symlink_to(tmp_path / "secret.obj")
    files = SceneFiles(folder)
    assert files.is_within(folder / name) == is_within
    assert files.exists(folder / name) == exists
