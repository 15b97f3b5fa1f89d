"""Is the inside of a closed mesh where parity says: outside of nothing, and inside of one part at most?"""

from __future__ import annotations

import numpy as np

from cdcore.containment.ray_parity import point_inside
from cdcore.mesh import TriangleMesh, once_a_mesh, winding
from cdcore.numerics import BoolArray, FloatArray
from cdcore.protocol import Motion


@once_a_mesh
def parity_is_inside(mesh: TriangleMesh) -> bool:
    """Whether no face is doubled and no connected parts overlap: there parity calls the inside of both outside.

    A part inside another is a hollow, and parity right, where it is wound the other way. Parts that touch count as
    overlapping. Self-intersections of one part are not looked for. Cost: one exact query of the parts that are near
    each other; nothing for a mesh of one part.
    """
    if mesh.has_doubled_faces:
        return False
    components = connected_components(mesh)
    near = components_near_each_other(components)
    return not near or not (components_that_meet(components, near).any() or components_inside_alike(components, near))


def connected_components(mesh: TriangleMesh) -> list[FloatArray]:
    """Triangles (f, 3, 3) of each connected part."""
    order = np.argsort(mesh.components, kind="stable")
    return np.split(mesh.triangles[order], np.flatnonzero(np.diff(mesh.components[order])) + 1)


def components_near_each_other(components: list[FloatArray]) -> list[tuple[int, int]]:
    """Numbers of two parts whose boxes meet, the lower first."""
    if len(components) < 2:
        return []
    lower, upper = (np.array([bound(component, axis=(0, 1)) for component in components]) for bound in (np.min, np.max))
    near = []
    for k in range(len(components) - 1):
        overlaps = ((lower[k + 1 :] <= upper[k]) & (lower[k] <= upper[k + 1 :])).all(axis=1)
        near += [(k, k + 1 + int(j)) for j in np.flatnonzero(overlaps)]
    return near


def components_that_meet(components: list[FloatArray], pairs: list[tuple[int, int]]) -> BoolArray:
    """Whether the surfaces of two parts meet, for each of ``pairs``, (n,)."""
    # Here, since most meshes have one part: whoever asks only for parity compiles no more than that.
    from cdcore.narrow.bvh.box_tree import build_box_trees
    from cdcore.narrow.bvh.whole_motion import decide_motion

    used, renumbered = np.unique(pairs, return_inverse=True)
    count = len(used)
    as_they_lie = Motion([0.0], np.zeros((1, count, 3)), np.tile(np.eye(3), (1, count, 1, 1)))
    trees = build_box_trees([np.ascontiguousarray(components[k]) for k in used])
    return decide_motion(trees, renumbered.reshape(-1, 2), as_they_lie).hits[0]


def components_inside_alike(components: list[FloatArray], pairs: list[tuple[int, int]]) -> bool:
    """Whether some part that meets no other lies in a region that is inside others already: hollows cancel them."""
    windings = [winding(component) for component in components]
    around = windings.copy()
    for inner, outer in (*pairs, *((j, k) for k, j in pairs)):
        if point_inside(components[inner][0, 0], components[outer]):
            around[inner] += windings[outer]
    return max(map(abs, around)) > 1
