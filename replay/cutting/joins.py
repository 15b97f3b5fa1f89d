"""The finest convex pieces of a body, and the joins that make fewer of them."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import combinations

import numpy as np

from cdcore.bounding.hull import hull_of
from cdcore.mesh import TriangleMesh
from cdcore.numerics import FloatArray, IntArray
from replay.cutting.convex_solids import volume_of


@dataclass(frozen=True, eq=False)
class Ladder:
    """The finest pieces of a body, and the joins that make fewer of them.

    ``corners``: (n, 3) of all pieces; ``ends``: (k,) where those of each piece end; ``joins``: (j, 2) numbers of pieces
    that become one; a joined piece takes the next number after all before it.
    """

    corners: FloatArray
    ends: IntArray
    joins: IntArray

    def pieces(self, most_pieces: int) -> list[FloatArray]:
        """Corners (n, 3) of each of at most so many pieces, or of as few as there can be."""
        pieces = dict(enumerate(np.split(self.corners, self.ends[:-1])))
        number = len(pieces)
        for first, second in self.joins.tolist():
            if len(pieces) <= most_pieces:
                break
            pieces[number] = np.concatenate([pieces.pop(first), pieces.pop(second)])
            number += 1
        return list(pieces.values())


def joins_by_volume(pieces: Sequence[TriangleMesh]) -> Ladder:
    """The pieces, joined until one is left: each time the two whose hull adds least of their volume."""
    corners = np.concatenate([piece.vertices for piece in pieces])
    ends = np.cumsum([len(piece.vertices) for piece in pieces])
    return Ladder(corners, ends, np.array(_least_volume_joins(pieces), dtype=np.int64).reshape(-1, 2))


def _least_volume_joins(pieces: Sequence[TriangleMesh]) -> list[tuple[int, int]]:
    """From these pieces down to one: each time the two are joined whose hull adds least.

    Least of their own volume: a thin ring closes the mouth of a beaker with little volume, and much of its own.
    """
    hulls, current_numbers = [*pieces], [*range(len(pieces))]
    joins: list[tuple[int, int]] = []

    @cache
    def join(a: int, b: int) -> tuple[float, TriangleMesh | None]:
        """The fraction that the hull of two pieces adds, and that hull; pieces with a gap between them have none."""
        (lower, upper), (other_lower, other_upper) = _box(hulls[a]), _box(hulls[b])
        hull = None
        if (lower <= other_upper + 1e-4).all() and (other_lower <= upper + 1e-4).all():
            hull = hull_of(np.concatenate([hulls[a].vertices, hulls[b].vertices]))
        if hull is None:
            return np.inf, None
        separate_volume = volume_of(hulls[a]) + volume_of(hulls[b])
        return (volume_of(hull) - separate_volume) / separate_volume, hull

    while len(current_numbers) > 1:
        # Of joins that add the same, the one that was there first.
        best_pair = min(
            combinations(current_numbers, 2), key=lambda pair: (join(*pair)[0], max(pair[1], len(pieces) - 1), pair)
        )
        hull = join(*best_pair)[1]
        if hull is None:
            break
        joins.append(best_pair)
        hulls.append(hull)
        current_numbers = [*(number for number in current_numbers if number not in best_pair), len(hulls) - 1]
    return joins


def _box(piece: TriangleMesh) -> tuple[FloatArray, FloatArray]:
    return piece.vertices.min(axis=0), piece.vertices.max(axis=0)
