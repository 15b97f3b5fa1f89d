"""Capsules and cylinders whose ends may differ, and cones, along +Y: inscribed in the true shape."""

from typing import Final

import numpy as np

from sessions.geometry.shapes import make_shape
from sessions.mesh_data import MeshData
from sessions.meshes.hull import hull_of_points

ROUND_FACES: Final = 4000


def tapered_shape(shape: str, height: float, lower: float, upper: float) -> MeshData | None:
    """A ``capsule`` or ``cylinder`` with the radii of its lower and upper end; of two radii the hull of both ends.

    ``height``: of a cylinder the whole, of a capsule that between the middles of its ends. An end of radius 0 is a
    point; ``None``: both ends are, or the height is none. Raises ``SceneError``: an impossible size.
    """
    is_capsule = shape == "capsule"
    if lower == upper:
        length = height + 2.0 * lower if is_capsule else height
        return make_shape(shape, {"radius": lower, "length": length}, ROUND_FACES)
    if height < 0.0 or not (height or is_capsule):
        return None
    points = []
    for end, side in ((lower, -1.0), (upper, 1.0)):
        centre = np.array([[0.0, side * height / 2.0, 0.0]])
        if end > 0.0:
            size = {"radius": end} if is_capsule else {"radius": end, "length": height}
            corners = make_shape("sphere" if is_capsule else "cylinder", size, ROUND_FACES).vertices
            # Of a cylinder both discs of an end are laid in the end's plane.
            points.append(centre + (corners if is_capsule else corners * [1.0, 0.0, 1.0]))
        elif end == 0.0:
            points.append(centre)
    corners = np.unique(np.concatenate(points), axis=0)
    return hull_of_points(corners) if len(points) == 2 else None
