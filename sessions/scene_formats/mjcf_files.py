"""Checks the files of an MJCF before MuJoCo reads one: where they lie, circles, and how much they ask for.

MuJoCo follows a circle of attached models until it crashes, and copies what is replicated until the memory is full.
"""

from dataclasses import dataclass, field
from math import prod
from pathlib import Path
from typing import Final
from xml.etree import ElementTree

from sessions.errors import SceneSourceError
from sessions.scene_formats.safe_files import MOST_DEPTH, SceneFiles

FILE_ATTRIBUTES: Final = ("file", "fileright", "fileleft", "fileup", "filedown", "filefront", "fileback")
FOLDER_ATTRIBUTES: Final = ("meshdir", "texturedir", "assetdir")
SIZES: Final = {
    "flexcomp": ("count",),
    "composite": ("count",),
    "hfield": ("nrow", "ncol"),
    "texture": ("width", "height"),
    "mesh": ("params",),
}
"""Element -> attributes whose product is how many nodes, heights, pixels or corners it asks for."""
NODES: Final = frozenset(("flexcomp", "composite"))
"""Elements of which each node is a body."""

USERS: Final = 1000
"""Elements that are taken to hold the values which a model gives each of them for users."""
MOST_ELEMENTS: Final = 200_000
"""Elements after replication; the largest model that was seen, a hundred humanoids, has 5,000."""
MOST_VALUES: Final = 100_000_000
"""Heights, pixels and corners of generated assets."""


@dataclass
class _Amount:
    """Amount that a file asks for, and the models that it attaches, each with the number of copies."""

    elements: int = 0
    values: int = 0
    attached: list[tuple[int, str]] = field(default_factory=list)

    def add(self, other: "_Amount", copies: int) -> None:
        self.elements += copies * other.elements
        self.values += copies * other.values


def check_mjcf(path: Path, files: SceneFiles) -> None:
    """Refuses files outside the folder in every place that MuJoCo may look for them, circles, and too large models.

    Raises ``SceneSourceError``.
    """
    _Check(files).model(path, ())


class _Check:
    """Reads each XML file once, so that files that include each other many times cost no more."""

    def __init__(self, files: SceneFiles) -> None:
        self._files = files
        self._models: dict[str, _Amount] = {}
        self._read: dict[tuple[Path, Path], _Amount] = {}

    def model(self, path: Path, above: tuple[Path, ...]) -> _Amount:
        """The amount of a model with what it includes and attaches."""
        elements: list[ElementTree.Element] = []
        total = self._file(path, path.parent, above, elements)
        whole = _Amount(total.elements, total.values)
        for copies, name in total.attached:
            whole.add(self._models.get(name, _Amount()), copies)
        if whole.elements > MOST_ELEMENTS or whole.values > MOST_VALUES:
            raise SceneSourceError(
                f"{path} asks for more than {MOST_ELEMENTS:,} parts or {MOST_VALUES:,} generated values; reduce it"
            )
        self._check_assets(path, elements)
        return whole

    def _file(self, path: Path, folder: Path, above: tuple[Path, ...], elements: list[ElementTree.Element]) -> _Amount:
        """The amount of one XML file with what it includes; ``elements`` gets the first element of each."""
        real = self._files.inside(path, f"the file {path.name!r}")
        if real in above:
            raise SceneSourceError(f"{path} includes itself, by way of {len(above)} files; take the circle out")
        if len(above) >= MOST_DEPTH:
            raise SceneSourceError(f"{path} is included more than {MOST_DEPTH} files deep; no scene is")
        if (real, folder) in self._read:
            return self._read[real, folder]
        first, total = self._files.xml(path), _Amount()
        elements.append(first)
        waiting = [(first, 1)]
        while waiting:
            element, copies = waiting.pop()
            if element.tag == "include":
                inner = folder / _file_of(element, path)
                self._files.inside(inner, f"the included file {element.get('file', '')!r}")
                included = self._file(inner, folder, (*above, real), elements)
                total.add(included, copies)
                total.attached += [(copies * count, name) for count, name in included.attached]
            elif element.tag == "model":
                inner = path.parent / _file_of(element, path)
                self._files.inside(inner, f"the model {element.get('file', '')!r}")
                self._models[element.get("name", "")] = self.model(inner, (*above, real))
            elif element.tag == "attach":
                total.attached.append((copies, element.get("model", "")))
            size = prod(_product(element, name) for name in SIZES.get(str(element.tag), ()))
            total.elements += copies * (size if element.tag in NODES else 1)
            total.values += 0 if element.tag in NODES else copies * size
            if element.tag == "size":
                total.values += USERS * sum(
                    _product(element, key) for key in element.attrib if key.startswith("nuser_")
                )
            inside = copies * _product(element, "count") if element.tag == "replicate" else copies
            waiting += [(child, inside) for child in element]
        self._read[real, folder] = total
        return total

    def _check_assets(self, path: Path, elements: list[ElementTree.Element]) -> None:
        compilers = [compiler for element in elements for compiler in element.iter("compiler")]
        named = [value for compiler in compilers for key, value in compiler.items() if key in FOLDER_ATTRIBUTES]
        folders = [*dict.fromkeys([path.parent, *(path.parent / value for value in named)])]
        for element in elements:
            for child in element.iter():
                names = [value for key, value in child.items() if key in FILE_ATTRIBUTES]
                for name in names if child.tag not in ("include", "model") else ():
                    self._check_asset(str(child.tag), name, folders)

    def _check_asset(self, tag: str, name: str, folders: list[Path]) -> None:
        """Refuse a file outside; where it is nowhere, the library says that it is missing."""
        # A model may strip names of their folders.
        bare = name.replace("\\", "/").rpartition("/")[2]
        candidates = [folder / form for form in dict.fromkeys((name, bare)) for folder in folders]
        present = [candidate for candidate in candidates if self._files.exists(candidate)]
        if not present and not any(self._files.is_within(folder / name) for folder in folders):
            present = candidates[:1]
        for candidate in present:
            self._files.inside(candidate, f"{tag} {name!r}")


def _file_of(element: ElementTree.Element, path: Path) -> str:
    name = element.get("file", "")
    if not name:
        raise SceneSourceError(f"{path} names no file in <{element.tag}>; correct it")
    return name


def _product(element: ElementTree.Element, name: str) -> int:
    """The product of the whole numbers of an attribute; 1 where it has none."""
    product = 1
    for word in element.get(name, "").split():
        try:
            product *= max(int(float(word)), 1)
        except (ValueError, OverflowError):
            continue
    return product
