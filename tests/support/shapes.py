"""Small meshes with known geometry, random poses, hulls at known distances, and surfaces in common planes."""

from functools import cache, wraps

import numpy as np
from scipy.spatial import ConvexHull

from cdcore import Body, Motion, TriangleMesh
from cdcore.poses import rotation_from_quaternion
from replay.studies.stress import solids
from replay.studies.stress.families import FAMILIES

MESHES = {}
"""Hash of its numbers -> the mesh that all tests of a process share."""


def shared(make):
    """The function, which returns the same mesh again where it would make an equal one.

    Meshes cannot be changed. Detectors keep trees, spheres and hulls of a mesh as long as it lives, so that tests with
    equal meshes prepare them once.
    """

    @wraps(make)
    def make_shared(*arguments, **settings):
        mesh = make(*arguments, **settings)
        return MESHES.setdefault(mesh.content_hash, mesh)

    return make_shared


ball_mesh = shared(solids.ball_mesh)
beaker_mesh = shared(solids.beaker_mesh)
box_mesh = shared(solids.box_mesh)
icosphere_mesh = cache(solids.icosphere_mesh)
merge_meshes = shared(solids.merge_meshes)
revolved_mesh = shared(solids.revolved_mesh)
rod_mesh = shared(solids.rod_mesh)
shift_mesh = shared(solids.shift_mesh)


def triangle_family(name: str):
    """The family of random triangle pairs of this name: its pairs are hard to decide in the way the name says."""
    return next(family for family in FAMILIES if family.name == name)


@shared
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


def unrotated_motion(positions, times=None, valid=None) -> Motion:
    """Bodies that keep their rotation at ``positions`` (T, N, 3), a frame a second unless ``times`` are given."""
    positions = np.asarray(positions, dtype=float)
    rotations = np.tile(np.eye(3), (*positions.shape[:2], 1, 1))
    return Motion(np.arange(len(positions)) if times is None else times, positions, rotations, valid)


def motion_at_rest(bodies, positions, frames=1) -> Motion:
    """Bodies that stand unrotated at ``positions`` (N, 3) for some frames of 1/90 s."""
    positions = np.asarray(positions, dtype=float)
    translations = np.broadcast_to(positions, (frames, *positions.shape))
    rotations = np.broadcast_to(np.eye(3), (frames, len(bodies), 3, 3))
    return Motion(np.arange(frames) / 90.0, translations, rotations, names=[body.name for body in bodies])


def lab_bodies_and_motion(frames=240, seed=0, gaps=True) -> tuple[list[Body], Motion]:
    """Five bodies, three of them on smooth random paths through the others, with poses missing now and then."""
    rng = np.random.default_rng(seed)
    bodies = [
        Body("table", box_mesh((0.6, 0.6, 0.02))),
        Body("beaker", beaker_mesh()),
        Body("rod", rod_mesh()),
        Body("ball", ball_mesh(0.012)),
        Body("wand", without_faces(ball_mesh(0.05, rings=6, sides=10), 3)),
    ]
    time = np.arange(frames) / 90.0
    centres = np.tile([[0, 0, -0.0101], [0, 0, 0], [0, 0, 0.03], [0.02, 0, 0.05], [0.1, 0, 0.05]], (frames, 1, 1))
    for body in (2, 3, 4):
        for axis in range(3):
            rate, phase = rng.uniform(0.3, 2.5, 3), rng.uniform(0, 6.28, 3)
            centres[:, body, axis] += 0.03 * np.sin(time[:, None] * 6.28 * rate + phase).sum(axis=1)
    orientation = np.tile(np.eye(3), (frames, 5, 1, 1))
    axis = rng.normal(size=(3, 3))
    for k, body in enumerate((2, 3, 4)):
        half = 0.3 * np.sin(time * 3 + k)
        direction = axis[k] / np.linalg.norm(axis[k])
        quaternion = np.column_stack([np.sin(half)[:, None] * direction, np.cos(half)])
        orientation[:, body] = rotation_from_quaternion(quaternion)
    valid = np.ones((frames, 5), dtype=bool)
    if gaps:
        valid[frames // 3 : frames // 3 + 7, 2] = False
        valid[: frames // 40, 3] = False
    # A stretch in which everything stands still, as tracking loss or a put-down tool gives.
    centres[frames // 2 : frames // 2 + 20], orientation[frames // 2 : frames // 2 + 20] = (
        centres[frames // 2],
        orientation[frames // 2],
    )
    return bodies, Motion(time, centres, orientation, valid, names=[body.name for body in bodies])


def convex(rng, size):
    """Random corners within ``size`` metres, and some within their hull that no face of the hull uses."""
    points = rng.normal(size=(rng.integers(8, 40), 3))
    return TriangleMesh(points * (size / np.ptp(points)), ConvexHull(points).simplices)


def hulls_at(seed, gaps):
    """Two hulls whose distance is each of the ``gaps``, below 0 their depth.

    Origins that make bodies touch form the hull of all differences of corners. From the middle of one of its faces
    straight out, the distance to it is the way gone.
    """
    rng = np.random.default_rng(seed)
    a, b, orientation = convex(rng, 0.1), convex(rng, 0.05), random_rotations(rng, 1)[0]
    differences = a.referenced_vertices[:, None] - b.referenced_vertices @ orientation.T
    touching = ConvexHull(differences.reshape(-1, 3))
    face = rng.integers(len(touching.simplices))
    middle, out = touching.points[touching.simplices[face]].mean(axis=0), touching.equations[face, :3]
    positions = np.zeros((len(gaps), 2, 3))
    positions[:, 1] = middle + np.outer(gaps, out)
    matrices = np.broadcast_to([np.eye(3), orientation], (len(gaps), 2, 3, 3))
    return [Body("a", a), Body("b", b)], Motion(np.arange(len(gaps)), positions, matrices)


STEP = 2.0**-10
"""Places are multiples of this, metres, so that every placed corner is a double without rounding."""


def grid_mesh(cells):
    """A flat square in z = 0 with a side of ``cells`` times STEP * 16: 2 cells^2 faces."""
    x, y = (coordinate.ravel() for coordinate in np.meshgrid(*[np.arange(cells + 1) * 16 * STEP] * 2, indexing="ij"))
    first = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    lower = np.stack([first, first + cells + 1, first + cells + 2], axis=1)
    upper = np.stack([first, first + cells + 2, first + 1], axis=1)
    return TriangleMesh(np.stack([x, y, np.zeros_like(x)], axis=1), np.concatenate([lower, upper]))


def fan_mesh(faces, height):
    """A cone without a floor: its hub at the origin, its rim at this height."""
    orientation, around = 2 * np.pi * np.arange(faces) / faces, np.arange(faces)
    corners = np.stack([np.cos(orientation), np.sin(orientation), np.full(faces, height)], axis=1)
    ring = np.stack([0 * around, 1 + around, 1 + (around + 1) % faces], axis=1)
    return TriangleMesh(np.concatenate([np.zeros((1, 3)), corners]), ring)


def two_bodies(first, second, positions, matrices=None):
    """Two bodies on a motion of 90 frames a second."""
    matrices = np.tile(np.eye(3), (len(positions), 2, 1, 1)) if matrices is None else matrices
    return [Body("first", first), Body("second", second)], Motion(np.arange(len(positions)) / 90.0, positions, matrices)


def sliding_grids(cells, frames):
    """Two grids in one plane, one of which slides to and fro and past the other's edge; and whether they meet, (T,)."""
    side, time = cells * 16, np.arange(frames)
    x = np.rint(side * (0.6 + 0.5 * np.sin(time / 20.0)))
    positions = np.zeros((frames, 2, 3))
    positions[:, 1, 0], positions[:, 1, 1] = x * STEP, np.rint(side * 0.3 * np.cos(time / 13.0)) * STEP
    return *two_bodies(grid_mesh(cells), grid_mesh(cells), positions), x <= side


def fans_at_their_hubs(faces, frames):
    """Two cones, hub on hub or apart by 1e-12 m, one of which turns; and whether they meet, (T,)."""
    time = np.arange(frames)
    separate = time % 3 == 0
    positions, matrices = np.zeros((frames, 2, 3)), np.tile(np.eye(3), (frames, 2, 1, 1))
    positions[:, :, 0] = np.rint(64 * np.sin(time / 20.0))[:, None] * STEP
    positions[separate, 1, 2] = -1e-12
    cos, sin = np.cos(0.01 * time), np.sin(0.01 * time)
    matrices[:, 1, 0, 0], matrices[:, 1, 1, 1], matrices[:, 1, 0, 1], matrices[:, 1, 1, 0] = cos, cos, -sin, sin
    return *two_bodies(fan_mesh(faces, 0.5), fan_mesh(faces, -0.5), positions, matrices), ~separate
