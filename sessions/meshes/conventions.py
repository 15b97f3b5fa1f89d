"""Poses of other systems in the canonical frame: right-handed, +X right, +Y up, -Z forward, metres.

Each convention exchanges axes and changes signs. A left-handed source is mirrored by this: the rotation axis of a
quaternion then changes its sign, the angle and ``w`` do not.

Source: the coordinate systems as documented by Unity, Unreal, Godot, OpenVR, OpenXR, glTF 2.0 and ROS REP 103.
"""

import re
import tomllib
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cached_property
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from sessions.errors import SessionError
from sessions.geometry.rotations import Array, quaternion_about, quaternion_product
from sessions.meshes.axes_text import axes_as_text, matrix_of_axes_text


@dataclass(frozen=True)
class Convention:
    """A coordinate system: canonical axis i is source axis ``axes[i]`` times ``signs[i]``.

    Parameters
    ----------
    euler_order : the order of turning that the system fixes, as `quaternion_from_euler` takes it; ``""``: none.
    euler_signs : signs of its angles about X, Y and Z.
    unit : its unit of lengths, or ``""``: none is fixed.
    assumed_handedness : whether the text that describes it leaves the handedness out.
    """

    name: str
    axes: tuple[int, int, int]
    signs: tuple[int, int, int]
    description: str
    euler_order: str = ""
    euler_signs: tuple[int, int, int] = (1, 1, 1)
    unit: str = ""
    assumed_handedness: bool = False

    @property
    def handedness(self) -> str:
        """``right`` or ``left``."""
        return "right" if self._determinant > 0 else "left"

    @property
    def is_canonical(self) -> bool:
        """Whether its axes are those of the canonical frame."""
        return self.axes == (0, 1, 2) and self.signs == (1, 1, 1)

    @property
    def up(self) -> tuple[int, int]:
        """The source axis that points up, and its sign."""
        return self.axes[1], self.signs[1]

    @property
    def matrix(self) -> Array:
        """The signed permutation (3, 3) that takes source points to canonical ones, column convention."""
        matrix = np.zeros((3, 3))
        matrix[[0, 1, 2], list(self.axes)] = self.signs
        return matrix

    @cached_property
    def _determinant(self) -> int:
        return round(float(np.linalg.det(self.matrix)))

    def points(self, points: ArrayLike) -> Array:
        """Source points (..., 3) in the canonical frame; lengths keep their unit."""
        given = np.asarray(points, dtype=np.float64)
        return given[..., list(self.axes)] * np.array(self.signs, dtype=np.float64)

    def source_points(self, points: ArrayLike) -> Array:
        """Canonical points (..., 3) in the axes of the source: undoes `points`."""
        given = np.asarray(points, dtype=np.float64) * np.array(self.signs, dtype=np.float64)
        return given[..., np.argsort(self.axes)]

    def source_quaternions(self, quaternions_xyzw: ArrayLike) -> Array:
        """Canonical quaternions (..., 4), xyzw, in the axes of the source: undoes `quaternions`."""
        given = np.asarray(quaternions_xyzw, dtype=np.float64)
        return np.concatenate([self._determinant * self.source_points(given[..., :3]), given[..., 3:]], axis=-1)

    def quaternions(self, quaternions_xyzw: ArrayLike) -> Array:
        """Source quaternions (..., 4), xyzw, in the canonical frame; norms stay as they are."""
        given = np.asarray(quaternions_xyzw, dtype=np.float64)
        return np.concatenate([self._determinant * self.points(given[..., :3]), given[..., 3:]], axis=-1)


def _read_table() -> dict[str, Convention]:
    rows = tomllib.loads(Path(__file__).with_name("conventions.toml").read_text("utf-8"))
    return {
        name: Convention(
            name=name,
            axes=tuple(row["axes"]),
            signs=tuple(row["signs"]),
            description=row["description"],
            euler_order=row.get("euler", ""),
            euler_signs=tuple(row.get("euler_signs", (1, 1, 1))),
            unit=row.get("unit", ""),
        )
        for name, row in rows.items()
    }


CONVENTIONS: Final[dict[str, Convention]] = _read_table()
"""Name -> convention of a source."""

AXES_TEXT: Final = "or axes as text, such as 'x forward, y up, right-handed'"


def convention(name: str) -> Convention:
    """Returns the row of ``CONVENTIONS`` of this name, or the convention that a text of axes describes.

    Capitals and signs between letters do not count: ``A-Frame`` is ``aframe``. Raises SessionError with the names.
    """
    plain = re.sub(r"[\W_]", "", name.lower())
    for row in CONVENTIONS.values():
        if re.sub(r"\W", "", row.name) == plain:
            return row
    described = matrix_of_axes_text(name)
    if described is None:
        near = get_close_matches(name.lower(), CONVENTIONS, n=1)
        suggestion = f"; did you mean {near[0]!r}?" if near else ""
        raise SessionError(f"no convention {name!r}{suggestion}; there are: {', '.join(CONVENTIONS)}, {AXES_TEXT}")
    matrix, states_handedness = described
    text = axes_as_text(matrix)
    right, up, back = (int(np.flatnonzero(row)[0]) for row in matrix)
    signs = round(matrix[0, right]), round(matrix[1, up]), round(matrix[2, back])
    return Convention(text, (right, up, back), signs, text, assumed_handedness=not states_handedness)


def pose_axes_alternatives(axes: Convention) -> tuple[str, ...]:
    """Returns the names of the conventions that poses may have, these axes first; of equal ones the first."""
    different: dict[bytes, str] = {}
    for row in (axes, *CONVENTIONS.values()):
        different.setdefault(row.matrix.tobytes(), row.name)
    return tuple(different.values())


def quaternion_from_euler(angles: ArrayLike, order: str) -> Array:
    """Quaternions (..., 4), xyzw, of Euler angles (..., 3) in radians.

    ``order`` is read as SciPy reads it: capital letters turn about the body's own axes in this order (``YXZ`` of
    A-Frame and three.js), small letters about the fixed axes (``zxy`` of Unity). ``angles[..., k]`` is the angle
    about ``order[k]``. SessionError where it does not name three axes, all capital or all small, or names one twice in
    a row.
    """
    own = order.isupper()
    known = len(order) == 3 and set(order) <= set("XYZ" if own else "xyz")
    if not known or order[0] == order[1] or order[1] == order[2]:
        raise SessionError(
            f"no Euler order {order!r}; give three of XYZ (own axes) or of xyz (fixed axes), no axis twice in a row"
        )
    given = np.asarray(angles, dtype=np.float64)
    rotations = [quaternion_about(np.eye(3)["xyz".index(axis)], given[..., k]) for k, axis in enumerate(order.lower())]
    first, second, third = rotations if own else rotations[::-1]
    return quaternion_product(quaternion_product(first, second), third)


def same_euler_order(first: str, second: str) -> bool:
    """Whether two orders turn alike: ``zxy`` about fixed axes is ``YXZ`` about the body's own."""
    return _about_own_axes(first) == _about_own_axes(second)


def _about_own_axes(order: str) -> str:
    return order if order.isupper() else order[::-1].upper()
