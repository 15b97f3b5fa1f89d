"""Separating moves: whether surfaces in contact come apart when no face moves by more than a step.

The depth of face pairs does not tell: it is 0 for cubes that stand in each other with faces in common planes. A move
that ends the contact proves that it is no deeper than the step. Two kinds are tried: shifts of a body along the normals
of what meets, and shells, where every face of a body moves along its own normal, so that a plug comes out of its hole.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from cdcore.narrow.brute_force import near_faces
from cdcore.numerics import EPS, FloatArray
from cdcore.triangles.decide import triangles_intersect

LONGEST_MITRE = 3.0
"""A corner of a shell moves by at most so many steps, however sharp it is; a cube's needs the root of 3."""
FLATTEST = 1e-6
"""Directions in which the faces around a corner span less than this share of their normals are left to the others."""
DIRECTIONS = 6
"""Shifts are tried along the normals of so many faces of each body, the most frequent ones."""
ROUNDING_ULPS = 16
"""Added to a step, times the size of the coordinates: moving rounds, and surfaces that just touch still meet."""
FIRST_TESTED = 64
"""Face pairs that meet and are asked first: a move that leaves one of them meeting separates nothing."""


def shell_vectors(triangles: FloatArray, faces: NDArray[np.integer]) -> FloatArray:
    """Moves of the corners of each face when all faces of a body move outward by 1, (f, 3, 3), in units of the step.

    A corner moves so that every face around it moves by 1 along its normal, if that can be; by least squares if not.
    ``triangles`` (f, 3, 3) corners, ``faces`` (f, 3) vertex numbers; faces without area do not count.
    """
    normal = unit(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]))
    count = int(faces.max()) + 1
    squares, sums = np.zeros((count, 3, 3)), np.zeros((count, 3))
    np.add.at(squares, faces.ravel(), np.repeat(normal[:, :, None] * normal[:, None, :], 3, axis=0))
    np.add.at(sums, faces.ravel(), np.repeat(normal, 3, axis=0))
    vectors = (np.linalg.pinv(squares, rcond=FLATTEST, hermitian=True) @ sums[:, :, None])[:, :, 0]
    length = np.sqrt((vectors * vectors).sum(axis=1, keepdims=True))
    vectors *= np.minimum(1.0, LONGEST_MITRE / np.maximum(length, 1.0))
    return vectors[faces]


def can_be_separated(
    first: FloatArray,
    second: FloatArray,
    shell_a: FloatArray,
    shell_b: FloatArray,
    meeting: NDArray[np.integer],
    step: float,
) -> bool:
    """Whether some move of the surfaces by ``step`` metres leaves no face pair that meets.

    True proves that a move by ``step``, and what rounding adds, ends the contact; False says that no tried move does.
    ``first`` and ``second`` are placed triangles, the shells their placed :func:`shell_vectors`; ``meeting`` (k, 2) are
    the face pairs that meet, at least one.
    """
    step += ROUNDING_ULPS * EPS * float(max(np.abs(first).max(), np.abs(second).max()))
    close = near_faces(first, second, 2 * LONGEST_MITRE * step)
    tested = meeting[np.unique(np.linspace(0, len(meeting) - 1, FIRST_TESTED).astype(np.int64))]
    for x, y in _moves(first, second, shell_a, shell_b, meeting):
        if not any(_meet(first, second, rows, step * x, step * y) for rows in (tested, close)):
            return True
    return False


def _meet(first: FloatArray, second: FloatArray, rows: NDArray[np.integer], x: FloatArray, y: FloatArray) -> bool:
    i, j = rows[:, 0], rows[:, 1]
    a, b = first[i] + (x[i] if x.ndim == 3 else x), second[j] + (y[j] if y.ndim == 3 else y)
    return bool(triangles_intersect(np.stack([a, b], axis=1)).any())


def _moves(
    first: FloatArray, second: FloatArray, shell_a: FloatArray, shell_b: FloatArray, meeting: NDArray[np.integer]
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """How the one and the other move, per step: their faces together by no more than one."""
    still = np.zeros(3)
    for direction in (*_directions(second, meeting[:, 1]), *_directions(first, meeting[:, 0])):
        yield direction, still
        yield -direction, still
    yield from ((-shell_a, still), (still, -shell_b), (shell_a, still), (still, shell_b))
    yield -shell_a / 2, -shell_b / 2


def _directions(placed: FloatArray, meeting: NDArray[np.integer]) -> FloatArray:
    """Unit normals of the faces that meet, the most frequent first, then their mean."""
    some = placed[np.unique(meeting)]
    normals = unit(np.cross(some[:, 1] - some[:, 0], some[:, 2] - some[:, 0]))
    _, row, count = np.unique(np.round(normals, 6), axis=0, return_index=True, return_counts=True)
    frequent = normals[row[np.argsort(-count, kind="stable")[:DIRECTIONS]]]
    return np.concatenate([frequent, unit(normals.mean(axis=0, keepdims=True))])


def unit(vectors: FloatArray) -> FloatArray:
    """Vectors (..., 3) of length 1; those without length stay zero."""
    length = np.sqrt((vectors * vectors).sum(axis=-1, keepdims=True))
    return vectors / np.where(length > 0, length, 1.0)
