"""Small meshes with known geometry, and random poses, for the tests of the collision core."""

import numpy as np

from cdcore import Body, Motion, TriangleMesh
from cdcore.transforms.rigid import rotation_from_quaternion
from replay.studies.stress.solids import (  # noqa: F401
    ball_mesh,
    beaker_mesh,
    box_mesh,
    icosphere_mesh,
    merged,
    moved,
    revolved_mesh,
    rod_mesh,
)  # fmt: skip


def without_faces(mesh: TriangleMesh, count: int) -> TriangleMesh:
    """The mesh without its last faces: an open surface."""
    return TriangleMesh(mesh.vertices, mesh.faces[:-count])


def random_rotations(rng: np.random.Generator, *shape: int) -> np.ndarray:
    """Uniform random rotations (..., 3, 3)."""
    return rotation_from_quaternion(rng.normal(size=(*shape, 4)))


def orthonormality_error(rotation: np.ndarray) -> np.ndarray:
    """Largest entry of ``|R^T R - I|`` for each matrix (..., 3, 3); infinity for a reflection, NaN where not finite."""
    error = np.abs(np.swapaxes(rotation, -1, -2) @ rotation - np.eye(3)).max(axis=(-2, -1))
    return np.where(np.linalg.det(rotation) < 0, np.inf, error)


def nearest_rotation(matrix: np.ndarray) -> np.ndarray:
    """The rotation nearest to each matrix (..., 3, 3) in the Frobenius norm."""
    u, _, vt = np.linalg.svd(matrix)
    return u @ vt


def unturned(places, times=None, valid=None) -> Motion:
    """Bodies that keep their rotation at ``places`` (T, N, 3), a frame a second unless ``times`` are given."""
    places = np.asarray(places, dtype=float)
    rotations = np.tile(np.eye(3), (*places.shape[:2], 1, 1))
    return Motion(np.arange(len(places)) if times is None else times, places, rotations, valid)


def still(bodies, places, frames=1) -> Motion:
    """Bodies that stand unrotated at ``places`` (N, 3) for some frames of 1/90 s."""
    places = np.asarray(places, dtype=float)
    translations = np.broadcast_to(places, (frames, *places.shape))
    rotations = np.broadcast_to(np.eye(3), (frames, len(bodies), 3, 3))
    return Motion(np.arange(frames) / 90.0, translations, rotations, names=[body.name for body in bodies])


def lab(frames=240, seed=0, gaps=True) -> tuple[list[Body], Motion]:
    """Five bodies, three of them on smooth random paths through the others, with poses missing now and then."""
    rng = np.random.default_rng(seed)
    bodies = [
        Body("table", box_mesh((0.6, 0.6, 0.02))), Body("beaker", beaker_mesh()), Body("rod", rod_mesh()),
        Body("ball", ball_mesh(0.012)), Body("wand", without_faces(ball_mesh(0.05, 6, 10), 3)),
    ]  # fmt: skip
    time = np.arange(frames) / 90.0
    place = np.tile([[0, 0, -0.0101], [0, 0, 0], [0, 0, 0.03], [0.02, 0, 0.05], [0.1, 0, 0.05]], (frames, 1, 1))
    for body in (2, 3, 4):
        for axis in range(3):
            rate, phase = rng.uniform(0.3, 2.5, 3), rng.uniform(0, 6.28, 3)
            place[:, body, axis] += 0.03 * np.sin(time[:, None] * 6.28 * rate + phase).sum(axis=1)
    turn = np.tile(np.eye(3), (frames, 5, 1, 1))
    axis = rng.normal(size=(3, 3))
    for k, body in enumerate((2, 3, 4)):
        half = 0.3 * np.sin(time * 3 + k)
        direction = axis[k] / np.linalg.norm(axis[k])
        quaternion = np.column_stack([np.sin(half)[:, None] * direction, np.cos(half)])
        turn[:, body] = rotation_from_quaternion(quaternion)
    valid = np.ones((frames, 5), dtype=bool)
    if gaps:
        valid[frames // 3 : frames // 3 + 7, 2] = False
        valid[: frames // 40, 3] = False
    # A stretch in which everything stands still, as tracking loss or a put-down tool gives.
    place[frames // 2 : frames // 2 + 20], turn[frames // 2 : frames // 2 + 20] = place[frames // 2], turn[frames // 2]
    return bodies, Motion(time, place, turn, valid, names=[body.name for body in bodies])
