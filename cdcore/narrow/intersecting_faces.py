"""The face pairs of two placed meshes that meet: decided exactly, each pair once, in order."""

import numpy as np
from numpy.typing import ArrayLike

from cdcore.mesh import TriangleMesh
from cdcore.narrow.bvh.box_tree import box_trees_of
from cdcore.narrow.bvh.whole_motion import decide_motion
from cdcore.numerics import IntArray
from cdcore.protocol import Motion


def intersecting_faces(
    mesh_a: TriangleMesh, mesh_b: TriangleMesh, pose_a: ArrayLike | None = None, pose_b: ArrayLike | None = None
) -> IntArray:
    """Face pairs of two placed meshes that have a point in common; touching counts.

    Choose it for one placement; for many poses of the same meshes the detector ``exact`` builds its trees once.

    Parameters
    ----------
    mesh_a, mesh_b : surfaces, open or closed, degenerate faces allowed.
    pose_a, pose_b : (4, 4) body to world, column convention; ``None``: the identity.

    Returns
    -------
    (k, 2) int64, face of A and face of B, unique and lexicographically sorted.

    Raises
    ------
    InvalidPoseError
        A pose is not finite or not rigid; body 0 is A, body 1 is B.

    Examples
    --------
    >>> floor = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> lift = np.eye(4)
    >>> lift[2, 3] = 1e-300
    >>> len(intersecting_faces(floor, floor)), len(intersecting_faces(floor, floor, pose_b=lift))
    (1, 0)
    """
    poses = [np.eye(4) if pose is None else np.asarray(pose, dtype=np.float64) for pose in (pose_a, pose_b)]
    motion = Motion.from_matrices([0.0], np.array([poses]), names=("A", "B"))
    trees = box_trees_of([mesh_a, mesh_b])
    return decide_motion(trees, np.array([[0, 1]]), motion, faces=True).sets.faces.astype(np.int64)
