"""Capsules between the joints of a hand: meshes, and poses over time that follow two joints.

A capsule with a radius at each end is the convex hull of two spheres. Its end nearer the tip of the finger lies at its
joint exactly; the other one is off where a bone changes its length, which tracked hands do by some tenths of a mm.
"""

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sessions.errors import SceneError
from sessions.geometry.rings import even_angles, revolved_rings, sewn
from sessions.geometry.rotations import quaternion_product
from sessions.importers.ledger import Numbers, Rows, Stamps
from sessions.mesh_data import MeshData
from sessions.model.session import Track

FACES: Final = 2000
"""Faces of a capsule, about: inscribed in the true one, at most 0.53 % of its radius inside it."""
SHORTEST, LONGEST = 0.5, 2.0
"""A bone of another length than these times its median is none: a joint is lost, or flew off."""
ALONG: Final = np.array([0.0, 1.0, 0.0])
"""The axis of a capsule in its own frame, from the joint nearer the wrist to the other."""


class BoneMotion(NamedTuple):
    """A bone over time.

    Parameters
    ----------
    track : poses of its capsule, in metres; lost where a joint is.
    length : its median, metres.
    change : how far its length is from the median in 95 % of the samples at most, metres.
    lost : samples with both joints that were flagged, because the bone would have an impossible length.
    """

    track: Track
    length: float
    change: float
    lost: int


def capsule_mesh(length: float, radius: float, parent_radius: float, faces: int = FACES) -> MeshData:
    """A closed mesh of the convex hull of two spheres: one about the origin, the other ``length`` below it (-Y).

    Of two spheres of which one holds the other it is the larger one.

    Raises ``SceneError``: a radius is not above 0.
    """
    if min(radius, parent_radius) <= 0.0 or length < 0.0:
        raise SceneError(f"a capsule has radii {radius:g} and {parent_radius:g} m; give radii above 0")
    # Twice as many sections around as steps from pole to pole: faces are as wide as high.
    sections = max(8, 2 * round(np.sqrt(faces) / 2.0))
    arcs = sections // 2
    # The tangent of both circles touches them at this angle above the plane across the axis.
    sine = (parent_radius - radius) / length if length > 0.0 else np.inf
    if abs(sine) >= 1.0:
        largest = max(radius, parent_radius)
        centre = 0.0 if radius >= parent_radius else -length
        outline = _arc(-np.pi / 2.0, np.pi / 2.0, arcs, largest, centre)
    else:
        tangent = float(np.arcsin(sine))
        lower = _arc(-np.pi / 2.0, tangent, max(2, arcs // 2), parent_radius, -length)
        upper = _arc(tangent, np.pi / 2.0, max(2, arcs // 2), radius, 0.0)
        outline = np.concatenate([lower, upper])
    outline[[0, -1], 0] = 0.0  # exact: the cosine of pi / 2 is 6e-17 in doubles
    return sewn(revolved_rings(outline, even_angles(sections), factor=1.0))


def _arc(first: float, last: float, steps: int, radius: float, centre: float) -> Numbers:
    angles = np.linspace(first, last, steps + 1)
    return np.column_stack([radius * np.cos(angles), centre + radius * np.sin(angles)])


def bone_motion(times_ns: Stamps, parent: Numbers, child: Numbers, valid: Rows) -> BoneMotion | None:
    """The motion of a capsule between two joints (n, 3) each, in metres; ``None``: they are never there together.

    ``valid`` (n,): where the source says that the hand was tracked.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        along = child - parent
        lengths = np.sqrt((along**2).sum(axis=1))
        present = np.isfinite(lengths) & (lengths > 0.0)
    if not present.any():
        return None
    # Exporters write zeros, or an earlier position, of joints that are not tracked.
    length = float(np.median(lengths[present & valid] if (present & valid).any() else lengths[present]))
    usable = present & (lengths > SHORTEST * length) & (lengths < LONGEST * length)
    directions = _carried_forward(along / np.where(usable, lengths, 1.0)[:, None], usable)
    quaternions = _rotations_along(directions)
    change = float(np.percentile(np.abs(lengths[usable & valid] - length), 95.0)) if (usable & valid).any() else 0.0
    positions = np.where(np.isfinite(child), child, 0.0)
    lost = int((np.isfinite(lengths) & valid & ~usable).sum())
    return BoneMotion(Track(times_ns, positions, quaternions, usable & valid), length, change, lost)


def _carried_forward(directions: Numbers, usable: Rows) -> Numbers:
    """The directions (n, 3), where one is not usable the last before it, else the first of all."""
    rows = np.where(usable, np.arange(len(usable)), -1)
    rows = np.maximum.accumulate(rows)
    first = int(np.flatnonzero(usable)[0])
    kept: Numbers = directions[np.where(rows < 0, first, rows)]
    return kept


def _rotations_along(directions: Numbers) -> NDArray[np.float64]:
    """Quaternions xyzw (n, 4) that take +Y along each direction (n, 3), with the least twist from one to the next.

    A capsule is the same however it is twisted; a twist that jumped would read as a body that spins.
    """
    plain = _shortest(np.broadcast_to(ALONG, directions.shape), directions)
    steps = quaternion_product(_shortest(directions[:-1], directions[1:]), plain[:-1])
    twists = quaternion_product(plain[1:] * np.array([-1.0, -1.0, -1.0, 1.0]), steps)
    angles = np.concatenate([[0.0], np.cumsum(2.0 * np.arctan2(twists[:, 1], twists[:, 3]))])
    about = np.zeros((len(directions), 4))
    about[:, 1], about[:, 3] = np.sin(angles / 2.0), np.cos(angles / 2.0)
    quaternions = quaternion_product(plain, about)
    # Of the two quaternions of a rotation that nearer the one before.
    flips = np.cumprod(np.where((quaternions[1:] * quaternions[:-1]).sum(axis=1) < 0.0, -1.0, 1.0))
    quaternions[1:] *= flips[:, None]
    return quaternions


def _shortest(start: Numbers, end: Numbers) -> Numbers:
    """The quaternions (n, 4) of the shortest rotations between unit vectors (n, 3), opposite ones included."""
    cosine = (start * end).sum(axis=1)
    quaternions = np.column_stack([np.cross(start, end), 1.0 + cosine])
    opposite = cosine < -1.0 + 1e-12
    if opposite.any():
        least = np.eye(3)[np.abs(start[opposite]).argmin(axis=1)]
        quaternions[opposite] = np.column_stack([np.cross(start[opposite], least), np.zeros(int(opposite.sum()))])
    return quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)
