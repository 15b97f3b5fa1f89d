"""The moment between two frames at which two bodies first touch: when, in which faces, at which point."""

from dataclasses import replace
from typing import Final

import numpy as np

from cdcore import Motion
from cdcore.numerics import FloatArray, IntArray
from replay.auditing.outcome import FirstTouch
from replay.effects.output import vector_of
from replay.prepare.assembly import Assembly

GAP_ROUNDING_M: Final = 1e-9
"""Metres of gap below which rounding decides its direction: then that between the bodies is taken."""


def first_touch(assembly: Assembly, pair: int, frame: int) -> FirstTouch | None:
    """When a pair first touches between ``frame`` and the next; ``None`` where no touch is known."""
    # With its compiler and engine: only an oracle of intervals needs them.
    from cdcore import TriangleMesh, time_of_impact
    from cdcore.narrow.fcl_meshes import FclMeshes

    pair_bodies, motion = assembly.pairs[pair], assembly.motion
    a, b = pair_bodies.tolist()
    frame_slice = slice(frame, frame + 2)
    if frame < 0 or frame + 1 >= len(motion) or not motion.valid[frame_slice][:, pair_bodies].all():
        return None
    meshes = [assembly.bodies[body].mesh for body in (a, b)]
    frame_times = float(motion.times[frame]), float(motion.times[frame + 1])
    impact = time_of_impact(
        meshes[0],
        _pose_matrices(motion, frame_slice, a),
        meshes[1],
        _pose_matrices(motion, frame_slice, b),
        times=frame_times,
    )
    if impact.faces is None:
        return None
    assert impact.toi is not None  # faces that meet have a moment
    # At ``free`` they are still apart, by what they move in a microsecond: there the gap has a direction.
    motion_at_touch = poses_between(motion, pair_bodies, np.array([impact.toi[0]]))
    rotations, positions = motion_at_touch.rotations[0], motion_at_touch.translations[0]
    faces = FclMeshes(
        [TriangleMesh(mesh.triangles[face], [[0, 1, 2]]) for mesh, face in zip(meshes, impact.faces, strict=True)]
    )
    for k in range(2):
        faces.set_pose(k, rotations[k], positions[k])
    gap, (point, point_of_second) = faces.gap(0, 1)
    gap_vector = point_of_second - point
    if gap <= GAP_ROUNDING_M:
        centres = np.stack([mesh.referenced_vertices.mean(axis=0) for mesh in meshes])
        gap_vector = np.diff(np.einsum("kij,kj->ki", rotations, centres) + positions, axis=0)[0]
    later_ns = round((impact.toi[1] - frame_times[0]) * 1e9)
    return FirstTouch(
        frame,
        impact.toi[0],
        impact.toi[1],
        later_ns,
        impact.faces,
        vector_of((point + point_of_second) / 2),
        vector_of(direction(gap_vector)),
    )


def direction(vector: FloatArray) -> FloatArray:
    """The unit vector along another one; up where it has no length."""
    length = float(np.linalg.norm(vector))
    return vector / length if length > 0.0 else np.array([0.0, 1.0, 0.0])


def poses_between(motion: Motion, bodies: IntArray, moments: FloatArray) -> Motion:
    """These bodies at moments between frames (n,), as a motion of n frames with a separate clock.

    Origins move along lines, rotations at a constant rate along the shorter arc, as ``continuous`` moves them.
    """
    from scipy.spatial.transform import Rotation

    times = motion.times
    frames_after = np.clip(np.searchsorted(times, moments), 1, len(times) - 1)
    frames_before = frames_after - 1
    fraction = (moments - times[frames_before]) / (times[frames_after] - times[frames_before])
    grid_indices = np.ix_(frames_before, bodies), np.ix_(frames_after, bodies)
    start, end = (motion.translations[row] for row in grid_indices)
    start_rotation, end_rotation = (
        Rotation.from_matrix(motion.rotations[row].reshape(-1, 3, 3)) for row in grid_indices
    )
    rotation_vectors = (start_rotation.inv() * end_rotation).as_rotvec() * np.repeat(fraction, len(bodies))[:, None]
    rotations = (start_rotation * Rotation.from_rotvec(rotation_vectors)).as_matrix().reshape(*start.shape, 3)
    translations = start + fraction[:, None, None] * (end - start)
    return Motion(np.arange(len(moments), dtype=np.float64), translations, rotations)


def at_touch(assembly: Assembly, pair: int, touch: FirstTouch) -> Assembly:
    """The assembly as one frame: the pair where it touches, all others where the frame before has them."""
    pair_bodies, frame_slice = assembly.pairs[pair], slice(touch.frame, touch.frame + 1)
    motion = assembly.motion
    pair_motion = poses_between(motion, pair_bodies, np.array([touch.moment]))
    positions, rotations = motion.translations[frame_slice].copy(), motion.rotations[frame_slice].copy()
    positions[:, pair_bodies], rotations[:, pair_bodies] = pair_motion.translations, pair_motion.rotations
    return replace(assembly, motion=Motion(np.array([touch.moment]), positions, rotations, motion.valid[frame_slice]))


def _pose_matrices(motion: Motion, frame_slice: slice, body: int) -> FloatArray:
    poses = np.tile(np.eye(4), (2, 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = motion.rotations[frame_slice, body], motion.translations[frame_slice, body]
    return poses
