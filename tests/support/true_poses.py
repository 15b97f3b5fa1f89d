"""Whether an imported track has the poses that were written, judged by SciPy alone."""

import numpy as np
from scipy.spatial.transform import Rotation

ROS = np.array([[0.0, -1, 0], [0, 0, 1], [-1, 0, 0]])
"""REP 103 to right-handed, +Y up, -Z forward."""
UNITY = np.diag([1.0, 1.0, -1.0])
"""Left-handed, +Y up, +Z forward to the same."""


def has_poses(track, places, turns, axes=None, stamps=None, tolerance=1e-9):
    """Whether all its samples are valid, at these stamps, with places (n, 3) and rotations turned into ``axes``."""
    axes = np.eye(3) if axes is None else axes
    found = Rotation.from_quat(track.quaternions_xyzw).as_matrix()
    return (
        track.valid.all()
        and np.allclose(track.positions, np.asarray(places) @ axes.T, rtol=0, atol=tolerance)
        and np.allclose(found, axes @ turns.as_matrix() @ axes.T, rtol=0, atol=tolerance)
        and (stamps is None or track.times_ns.tolist() == np.asarray(stamps).tolist())
    )
