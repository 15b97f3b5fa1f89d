"""A body is a name and a surface. Its poses belong to a motion."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from cdcore.errors import InvalidPairError
from cdcore.mesh import TriangleMesh
from cdcore.numerics import BoolArray, IntArray


@dataclass(frozen=True, eq=False)
class Solids:
    """Solids that stand for a mesh, in its frame, and one surface around them, where parity tells inside from out."""

    parts: tuple[TriangleMesh, ...]
    surface: TriangleMesh


@dataclass(frozen=True, eq=False)
class Body:
    """One rigid thing: its name, unique within a scene, and its surface in its own frame.

    ``colliders``: solids in place of the surface, as an engine has them or a tool has cut them; ``collider`` with the
    shape "shipped" or "compound" asks them, no other detector does.
    """

    name: str
    mesh: TriangleMesh
    colliders: Solids | None = None


def resolve_pairs(bodies: Sequence[Body], pairs: ArrayLike | None) -> IntArray:
    """The body numbers, (P, 2) int64, of the pairs asked for: each row as given (i, j), the order of rows kept.

    ``pairs`` (P, 2) are numbers or names of bodies, whose names differ, in any order; ``None`` for all i < j.
    InvalidPairError for an unknown body, a body paired with itself, or one pair twice.
    """
    names = [body.name for body in bodies]
    repeated = {name for name in names if names.count(name) > 1} if len(set(names)) != len(names) else set()
    if repeated:
        raise InvalidPairError(f"body names must differ; used twice: {', '.join(sorted(repeated))}")
    if pairs is None:
        rows = [(i, j) for i in range(len(names)) for j in range(i + 1, len(names))]
        return np.array(rows, dtype=np.int64).reshape(-1, 2)
    number = {name: index for index, name in enumerate(names)}
    given: Any = pairs.tolist() if isinstance(pairs, np.ndarray) else pairs
    resolved = [_resolve_pair(tuple(row), number) for row in given]
    unordered = [tuple(sorted(row)) for row in resolved]
    if len(set(unordered)) != len(unordered):
        twice = next(row for row in unordered if unordered.count(row) > 1)
        raise InvalidPairError(f"pair {names[twice[0]]}-{names[twice[1]]} is asked for twice; name each pair once")
    return np.array(resolved, dtype=np.int64).reshape(-1, 2)


def ordered_by_name(bodies: Sequence[Body], pairs: IntArray) -> tuple[IntArray, BoolArray]:
    """Each pair with the body first whose name sorts first, (P, 2), and which rows that turned round, (P,).

    Asked in this order, an engine whose answer depends on the order of its operands gives one answer for a pair,
    however the pair was written down.
    """
    rank = np.empty(len(bodies), dtype=np.int64)
    rank[sorted(range(len(bodies)), key=lambda k: bodies[k].name)] = np.arange(len(bodies))
    swapped = rank[pairs[:, 0]] > rank[pairs[:, 1]]
    ordered = pairs.copy()
    ordered[swapped] = pairs[swapped][:, ::-1]
    return ordered, swapped


def _resolve_pair(row: tuple[object, ...], number: dict[str, int]) -> tuple[int, int]:
    if len(row) != 2:
        raise InvalidPairError(f"a pair has two bodies, not {len(row)}: {row}")
    i, j = (_resolve_body(end, number) for end in row)
    if i == j:
        raise InvalidPairError(f"body {row[0]!r} is paired with itself; a pair needs two bodies")
    return i, j


def _resolve_body(end: object, number: dict[str, int]) -> int:
    if isinstance(end, str) and end in number:
        return number[end]
    if isinstance(end, (int, np.integer)) and 0 <= end < len(number):
        return int(end)
    raise InvalidPairError(f"no body {end!r}; there are: {', '.join(number)}")
