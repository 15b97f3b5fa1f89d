"""Files of a scene of another program: none is read outside its folder, and none that would fill the memory."""

from pathlib import Path
from typing import Final
from xml.etree import ElementTree

from sessions.errors import SceneSourceError
from sessions.file_kinds import XML
from sessions.input_files import check_regular, kind_of_file

MOST_XML_BYTES: Final = 32_000_000
MOST_FILE_BYTES: Final = 256_000_000
MOST_BYTES: Final = 1_000_000_000
"""Of one XML file, of one mesh or image, and of all files of a scene."""
MOST_DEPTH: Final = 100
"""Elements within each other; the deepest robot that was seen has 60."""


class SceneFiles:
    """The files of a scene within one folder.

    Raises ``SceneSourceError`` where a file lies outside, is missing, too large, or XML that declares entities.
    """

    def __init__(self, root: Path) -> None:
        self.root = root.resolve()
        self._total: dict[Path, int] = {}

    def inside(self, path: Path, named: str) -> Path:
        """The path of a file of the scene, links followed; ``named``: as the scene names it."""
        real = _resolved_path(path)
        if real is None:
            raise SceneSourceError(f"{named} is no path to a file: a link to itself, or too long; correct the scene")
        if not real.is_relative_to(self.root):
            raise SceneSourceError(
                f"{named} lies outside {self.root}, and nothing there is read; where it belongs to the scene, name the "
                "folder that holds all of it: root"
            )
        check_regular(real, "file of the scene", SceneSourceError)
        if not real.is_file():
            raise SceneSourceError(f"{named} is missing: there is no file {real}; put it there, or correct the scene")
        size = real.stat().st_size
        self._total[real] = size
        if size > MOST_FILE_BYTES:
            raise SceneSourceError(
                f"{named} has {_megabytes(size)}, more than {_megabytes(MOST_FILE_BYTES)}; reduce it"
            )
        if sum(self._total.values()) > MOST_BYTES:
            raise SceneSourceError(f"the files up to {named} have more than {_megabytes(MOST_BYTES)}; reduce the scene")
        return real

    def is_within(self, path: Path) -> bool:
        """Whether a path leads into the scene's folder, to a file or not."""
        real = _resolved_path(path)
        return real is not None and real.is_relative_to(self.root)

    def exists(self, path: Path) -> bool:
        """Whether something stands at a path, within the folder or outside."""
        real = _resolved_path(path)
        return real is not None and real.exists()

    def read(self, path: Path, named: str) -> bytes:
        """The bytes of a file of the scene."""
        return self.inside(path, named).read_bytes()

    def xml(self, path: Path) -> ElementTree.Element:
        """The first element of an XML file without a document type: entities may grow without bound."""
        real = self.inside(path, str(path))
        if real.stat().st_size > MOST_XML_BYTES:
            raise SceneSourceError(f"{path} has {_megabytes(real.stat().st_size)} of XML; a scene has fewer")
        try:
            text = real.read_bytes().decode("utf-8-sig")
        except UnicodeDecodeError as error:
            kind = kind_of_file(real)
            reason = f" but {kind}" if kind else "; save it so"
            raise SceneSourceError(f"{path} is no XML in UTF-8{reason}") from error
        if "<!DOCTYPE" in text or "<!ENTITY" in text:
            raise SceneSourceError(f"{path} declares a document type or entities, which no scene needs; take them out")
        try:
            element = ElementTree.fromstring(text)
        except ElementTree.ParseError as error:
            kind = kind_of_file(real)
            reason = f"({error}); correct it" if kind in (None, XML) else f"but {kind}"
            raise SceneSourceError(f"{path} is no readable XML {reason}") from error
        if _depth(element) > MOST_DEPTH:
            raise SceneSourceError(f"{path} has more than {MOST_DEPTH} elements within each other; no scene has")
        return element


def _resolved_path(path: Path) -> Path | None:
    """The path with its links followed; ``None``: it leads to itself, or no system can open it."""
    try:
        real = path.resolve()
        real.exists()
    except (OSError, RuntimeError, ValueError):
        return None
    return real


def _depth(element: ElementTree.Element) -> int:
    """How many elements lie within each other, up to one more than is allowed."""
    level, depth = [element], 0
    while level and depth <= MOST_DEPTH:
        level, depth = [child for parent in level for child in parent], depth + 1
    return depth


def _megabytes(size: int) -> str:
    return f"{size / 1e6:,.0f} MB"
