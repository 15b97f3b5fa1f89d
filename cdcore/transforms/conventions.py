"""Changes of basis to the canonical frame: right-handed, +X right, +Y up, -Z forward, metres.

Every row is one signed permutation F from source axes to canonical ones: a point becomes ``F p``, a rotation
``F R F^T``, a pose ``F T F^T``. Where F mirrors (Unity), rotations stay rotations: F acts twice.

Source: the coordinate systems as their makers document them (Unity, OpenVR, OpenXR, glTF 2.0, ROS REP 103).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdcore.errors import InvalidPoseError, InvalidSettingError
from cdcore.numerics import FloatArray, readonly


@dataclass(frozen=True, eq=False)
class Convention:
    """One source of coordinates: ``basis`` (3, 3) takes its points to the canonical frame."""

    name: str
    basis: FloatArray
    axes: str

    def __post_init__(self) -> None:
        readonly(self.basis)

    @property
    def mirrors(self) -> bool:
        """Whether the source is left-handed, so that its meshes turn inside out on the way."""
        return bool(np.linalg.det(self.basis) < 0)

    def points(self, points: ArrayLike) -> FloatArray:
        """Source points (..., 3) in the canonical frame."""
        converted: FloatArray = np.asarray(points, dtype=np.float64) @ self.basis.T
        return converted

    def rotations(self, rotations: ArrayLike) -> FloatArray:
        """Source rotations (..., 3, 3), column convention, in the canonical frame: ``F R F^T``."""
        converted: FloatArray = self.basis @ np.asarray(rotations, dtype=np.float64) @ self.basis.T
        return converted

    def poses(self, poses: ArrayLike) -> FloatArray:
        """Source poses (..., 4, 4), column convention, in the canonical frame: ``F T F^T``."""
        square = _homogeneous(self.basis)
        converted: FloatArray = square @ np.asarray(poses, dtype=np.float64) @ square.T
        return converted

    def inverse(self) -> Convention:
        """The way back: from canonical coordinates to those of the source."""
        return Convention(f"to {self.name}", self.basis.T.copy(), self.axes)


def _row(name: str, basis: list[list[int]], axes: str) -> Convention:
    return Convention(name, np.array(basis, dtype=np.float64), axes)


_SAME = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]

CONVENTIONS: Final[dict[str, Convention]] = {
    row.name: row
    for row in (
        _row("unity", [[1, 0, 0], [0, 1, 0], [0, 0, -1]], "left-handed, +Y up, +Z forward"),
        _row("openvr", _SAME, "right-handed, +Y up, -Z forward"),
        _row("openxr", _SAME, "right-handed, +Y up, -Z forward"),
        _row("gltf", _SAME, "right-handed, +Y up, asset front +Z"),
        _row("ros", [[0, -1, 0], [0, 0, 1], [-1, 0, 0]], "right-handed, +X forward, +Z up"),
        _row("z-up", [[1, 0, 0], [0, 0, 1], [0, -1, 0]], "right-handed, +Z up (3ds Max, Blender)"),
    )
}
"""Name -> convention of a source."""

MESH_FRAMES: Final[dict[str, FloatArray]] = {"raw-z": np.diag([1.0, 1.0, -1.0]), "gltf-x": np.diag([-1.0, 1.0, 1.0])}
"""How a file of a Unity mesh differs from Unity's own mesh coordinates, as F_m: raw dumps flip z, glTF exporters x.

Both reverse the winding. With ``gltf-x``, F_z F_m is a rotation by 180 degrees about Y: left out, everything faces
backwards.
"""


def convention_named(name: str) -> Convention:
    """The row of ``CONVENTIONS`` of this name.

    Raises
    ------
    InvalidSettingError
        Lists the names there are.
    """
    if name not in CONVENTIONS:
        raise InvalidSettingError(f"no convention {name!r}; there are: {', '.join(CONVENTIONS)}")
    return CONVENTIONS[name]


def mesh_poses(source: Convention, poses: ArrayLike, mesh_frame: FloatArray) -> FloatArray:
    """Poses that take the vertices of a mesh file to the canonical world: ``T_c = F T F_m^-1``.

    Parameters
    ----------
    source : where the poses (..., 4, 4) come from, body to world in its own frame, column convention.
    mesh_frame : (3, 3), F_m: from the source's mesh coordinates to those of the file (see ``MESH_FRAMES``).

    Raises
    ------
    InvalidPoseError
        The result mirrors: the file's handedness is not what was said.
    """
    given = np.asarray(poses, dtype=np.float64)
    converted: FloatArray = _homogeneous(source.basis) @ given @ np.linalg.inv(_homogeneous(mesh_frame))
    if given.size and not (np.linalg.det(converted[..., :3, :3]) > 0).all():
        raise InvalidPoseError(
            f"from {source.name} with this mesh frame the poses mirror the mesh; "
            "mirror its vertices once, reverse its winding, and name the frame of the result"
        )
    return converted


def reversed_winding(faces: NDArray[np.integer]) -> NDArray[np.integer]:
    """Faces (f, 3) turned inside out; a mirrored mesh needs this exactly once."""
    return np.ascontiguousarray(faces[:, ::-1])


def signed_volume(vertices: FloatArray, faces: NDArray[np.integer]) -> float:
    """Volume that a closed mesh encloses, cubic metres; negative if its faces look inward (a mirrored mesh does)."""
    a, b, c = (vertices[faces[:, k]] - vertices[faces[0, 0]] for k in range(3))
    return float(np.einsum("fk,fk->", a, np.cross(b, c)) / 6.0)


def _homogeneous(basis: FloatArray) -> FloatArray:
    square = np.eye(4)
    square[:3, :3] = basis
    return square
