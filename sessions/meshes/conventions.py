"""Poses of other systems in the canonical frame: right-handed, +X right, +Y up, -Z forward, metres.

Each convention exchanges axes and changes signs. A left-handed source is mirrored by this: the rotation axis of a
quaternion then changes its sign, the angle and ``w`` do not.

Source: the coordinate systems as documented by Unity, OpenVR, OpenXR, glTF 2.0 and ROS REP 103.
"""

import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from sessions.errors import SessionError
from sessions.geometry.rotations import Array, quaternion_about, quaternion_product


@dataclass(frozen=True)
class Convention:
    """A coordinate system: canonical axis i is source axis ``axes[i]`` times ``signs[i]``."""

    name: str
    axes: tuple[int, int, int]
    signs: tuple[int, int, int]
    words: str

    @property
    def handedness(self) -> str:
        """``right`` or ``left``."""
        return "right" if self._determinant > 0 else "left"

    @property
    def _determinant(self) -> int:
        even = self.axes in ((0, 1, 2), (1, 2, 0), (2, 0, 1))
        return int(np.prod(self.signs)) * (1 if even else -1)

    def points(self, points: ArrayLike) -> Array:
        """Source points (..., 3) in the canonical frame; lengths keep their unit."""
        given = np.asarray(points, dtype=np.float64)
        return given[..., list(self.axes)] * np.array(self.signs, dtype=np.float64)

    def quaternions(self, quaternions_xyzw: ArrayLike) -> Array:
        """Source quaternions (..., 4), xyzw, in the canonical frame; norms stay as they are."""
        given = np.asarray(quaternions_xyzw, dtype=np.float64)
        return np.concatenate([self._determinant * self.points(given[..., :3]), given[..., 3:]], axis=-1)


CONVENTIONS: dict[str, Convention] = {
    name: Convention(name, tuple(row["axes"]), tuple(row["signs"]), row["words"])
    for name, row in tomllib.loads(Path(__file__).with_name("conventions.toml").read_text("utf-8")).items()
}
"""Name -> convention of a source."""


def convention(name: str) -> Convention:
    """The row of ``CONVENTIONS`` of this name; SessionError with the names there are."""
    if name not in CONVENTIONS:
        raise SessionError(f"no convention {name!r}; there are: {', '.join(CONVENTIONS)}")
    return CONVENTIONS[name]


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
    turns = [quaternion_about(np.eye(3)["xyz".index(axis)], given[..., k]) for k, axis in enumerate(order.lower())]
    first, second, third = turns if own else turns[::-1]
    return quaternion_product(quaternion_product(first, second), third)
