"""The container of a GLB: its JSON, its buffers and the arrays that accessors make of them.

Nothing is allocated by a count that a file claims before its bytes are there.

Source: Khronos glTF 2.0 specification, sections 3.6 (buffers and accessors), 3.12 (extensions), 4.4 (GLB).
"""

import base64
import json
import struct
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sessions.errors import EmptyMeshError, MeshFileError

Array = NDArray[np.float64]
Row = dict[str, Any]

FILE_HEADER: Final = struct.Struct("<4sII")
JSON_CHUNK: Final = 0x4E4F534A
BINARY_CHUNK: Final = 0x004E4942
DATA_URI: Final = "data:"

COMPONENTS: Final = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS: Final = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
MOST_FACES: Final = 20_000_000
"""Of all instances: nodes may repeat a mesh, so a small file can ask for any number."""

SHAPE_PRESERVING: Final = frozenset(
    {
        "KHR_lights_punctual",
        "EXT_lights_ies",
        "EXT_lights_image_based",
        "KHR_materials_anisotropy",
        "KHR_materials_clearcoat",
        "KHR_materials_common",
        "KHR_materials_diffuse_transmission",
        "KHR_materials_dispersion",
        "KHR_materials_emissive_strength",
        "KHR_materials_ior",
        "KHR_materials_iridescence",
        "KHR_materials_pbrSpecularGlossiness",
        "KHR_materials_sheen",
        "KHR_materials_specular",
        "KHR_materials_transmission",
        "KHR_materials_unlit",
        "KHR_materials_variants",
        "KHR_materials_volume",
        "KHR_texture_basisu",
        "KHR_texture_transform",
        "EXT_texture_webp",
        "EXT_texture_avif",
        "MSFT_texture_dds",
        "KHR_xmp",
        "KHR_xmp_json_ld",
        "KHR_animation_pointer",
        "EXT_mesh_features",
        "EXT_structural_metadata",
        "KHR_mesh_quantization",
        "KHR_physics_rigid_bodies",
        "KHR_implicit_shapes",
        "OMI_physics_body",
        "OMI_physics_shape",
        "OMI_physics_joint",
    }
)
"""Extensions that leave a surface where it is, and quantization, whose types of numbers are read."""

DRACO: Final = "KHR_draco_mesh_compression"
MESHOPT: Final = ("EXT_meshopt_compression", "KHR_meshopt_compression")
INSTANCING: Final = "EXT_mesh_gpu_instancing"
VISIBILITY: Final = "KHR_node_visibility"
COMPRESSED: Final = "its meshes are compressed by {}; export it without compression"
REFUSED: Final = {
    DRACO: COMPRESSED.format("Draco"),
    **dict.fromkeys(MESHOPT, COMPRESSED.format("meshopt")),
    INSTANCING: f"it draws a mesh many times by {INSTANCING}; export a node for each",
}
"""Extension that changes a surface -> what it does, and what to do instead."""


class GlbFile:
    """The contents of a binary glTF 2.0 file.

    Raises ``MeshFileError``: no GLB, another version of glTF, cut short, a required extension that may change shapes;
    and an error of any kind where it is damaged.
    """

    def __init__(self, data: bytes) -> None:
        if not data:
            raise EmptyMeshError("the mesh file is empty; export it again")
        if data[:4] != b"glTF":
            raise MeshFileError("it does not begin as a GLB; export it as binary glTF")
        if len(data) < FILE_HEADER.size:
            raise MeshFileError("it ends within its header: cut short; export it again")
        _, version, length = FILE_HEADER.unpack_from(data)
        _check_version(f"{version}.0", least="2.0")
        if length > len(data):
            raise MeshFileError(f"it declares {length:,} bytes and holds {len(data):,}: cut short; export it again")
        chunks = _chunks(memoryview(data)[:length])
        self._json = _json(chunks[JSON_CHUNK])
        self._binary = chunks.get(BINARY_CHUNK, memoryview(b""))
        self._size = len(data)
        self._decoded: dict[int, memoryview] = {}
        asset = self._json.get("asset", {})
        _check_version(str(asset.get("version", "2.0")), least=str(asset.get("minVersion", "2.0")))
        for extension in self._json.get("extensionsRequired", ()):
            if extension not in SHAPE_PRESERVING:
                unknown = f"it requires the extension {extension}, which may change its shape; export it without"
                raise MeshFileError(REFUSED.get(extension, unknown))

    def rows(self, key: str) -> list[Row]:
        """The rows of a list of the JSON, such as ``"nodes"``; an index of another row counts from 0 and only up."""
        return self._json.get(key, [])

    @property
    def scene(self) -> list[int] | None:
        """The roots of the default scene; ``None`` where there is no scene.

        Raises MeshFileError: there are several, and none is the default.
        """
        scenes = self.rows("scenes")
        if len(scenes) > 1 and "scene" not in self._json:
            raise MeshFileError(f"it has {len(scenes)} scenes, and none is the default; export one scene")
        return at(scenes, self._json.get("scene", 0)).get("nodes", []) if scenes else None

    def count(self, number: int) -> int:
        """How many elements an accessor has."""
        count = int(at(self.rows("accessors"), number)["count"])
        if not 0 <= count <= 3 * MOST_FACES:
            raise MeshFileError(f"an accessor claims {count:,} values; export it again")
        return count

    def has_data(self, number: int) -> bool:
        """Whether an accessor has bytes of its own, so that what compresses it may be passed over."""
        return "bufferView" in at(self.rows("accessors"), number)

    def array(self, number: int) -> Array:
        """Return an accessor, (count, width) float64; whole numbers that stand for fractions are divided."""
        accessor = at(self.rows("accessors"), number)
        shape = self.count(number), WIDTHS[accessor["type"]]
        kind = np.dtype(COMPONENTS[accessor["componentType"]])
        if "bufferView" in accessor:
            values = self._values(accessor["bufferView"], accessor.get("byteOffset", 0), shape, kind).copy()
        elif "sparse" in accessor and shape[0] <= self._size:
            values = np.zeros(shape, dtype=kind)
        else:
            raise MeshFileError("an accessor of it has no data; export it again")
        if "sparse" in accessor:
            self._replace(values, accessor["sparse"])
        if not accessor.get("normalized"):
            return values.astype(np.float64)
        return np.maximum(values.astype(np.float64) / np.iinfo(kind).max, -1.0)

    def view(self, number: int) -> tuple[memoryview, Row]:
        """The bytes of a buffer view, and its row."""
        view = at(self.rows("bufferViews"), number)
        start = view.get("byteOffset", 0)
        data = self._buffer(view)[start : start + view["byteLength"]]
        if start < 0 or len(data) != view["byteLength"]:
            raise MeshFileError("a part of its data lies beyond its end: cut short; export it again")
        return data, view

    def _values(self, view: int, start: int, shape: tuple[int, int], kind: np.dtype[Any]) -> NDArray[Any]:
        data, row = self.view(view)
        width = kind.itemsize * shape[1]
        stride = row.get("byteStride", width)
        if stride < width or start < 0:
            raise MeshFileError("elements of an accessor overlap; export it again")
        return np.ndarray(shape, kind, data, start, (stride, kind.itemsize))

    def _replace(self, values: NDArray[Any], sparse: Row) -> None:
        """The elements that differ from the others, by their numbers."""
        count = int(sparse["count"])
        if not 0 <= count <= len(values):
            raise MeshFileError(f"an accessor replaces {count:,} of {len(values):,} values; export it again")
        numbers, elements = sparse["indices"], sparse["values"]
        kind = np.dtype(COMPONENTS[numbers["componentType"]])
        indices = self._values(numbers["bufferView"], numbers.get("byteOffset", 0), (count, 1), kind)[:, 0]
        shape = count, values.shape[1]
        values[indices] = self._values(elements["bufferView"], elements.get("byteOffset", 0), shape, values.dtype)

    def _buffer(self, view: Row) -> memoryview:
        number = view.get("buffer", 0)
        buffer = at(self.rows("buffers"), number)
        uri = buffer.get("uri")
        if uri is None and number == 0:
            return self._binary
        if isinstance(uri, str) and uri.startswith(DATA_URI):
            if number not in self._decoded:
                self._decoded[number] = memoryview(base64.b64decode(uri.partition(",")[2], validate=True))
            return self._decoded[number]
        if any(extension in view.get("extensions", {}) for extension in MESHOPT):
            raise MeshFileError(REFUSED[MESHOPT[0]])
        if uri is None:
            raise MeshFileError(f"its buffer {number} holds no data; export it again")
        raise MeshFileError("it keeps its data in another file; export it as one GLB")


def _json(chunk: memoryview) -> Row:
    try:
        content = json.loads(bytes(chunk))
    except (ValueError, RecursionError):
        content = None
    if not isinstance(content, dict):
        raise MeshFileError("its JSON is damaged; export it again")
    return content


def at(rows: list[Row], number: int) -> Row:
    """Return the row of this number; ``MeshFileError`` for one that is not there, negative ones included."""
    if not 0 <= number < len(rows):
        raise MeshFileError(f"it names row {number} of a list of {len(rows)}; export it again")
    return rows[number]


def _chunks(data: memoryview) -> dict[int, memoryview]:
    """Type -> content of the first chunk of each type."""
    chunks: dict[int, memoryview] = {}
    start = FILE_HEADER.size
    while start + 8 <= len(data):
        length, kind = struct.unpack_from("<II", data, start)
        content = data[start + 8 : start + 8 + length]
        if len(content) < length:
            raise MeshFileError("its chunks do not end: cut short; export it again")
        chunks.setdefault(kind, content)
        start += 8 + length
    if JSON_CHUNK not in chunks:
        raise MeshFileError("it holds no JSON; export it again")
    return chunks


def _check_version(version: str, least: str) -> None:
    """Raise ``MeshFileError`` for another major version, and for a file that needs more than its version 2.0."""
    if version.partition(".")[0] != "2" or least not in ("2", "2.0"):
        raise MeshFileError(f"it is glTF {version if least in ('2', '2.0') else least}; export it as glTF 2.0")
