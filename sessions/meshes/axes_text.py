"""Axes described in words, such as ``x forward, y up, left-handed``, as a signed permutation to the canonical frame.

A description needs the axis that points up. Of two directions the third follows from the handedness, which is right
where it is left out; where only up is given, the first free axis is taken for right: turning a room about its vertical
changes no contact.
"""

import re
from typing import Final

import numpy as np

from sessions.errors import SessionError
from sessions.geometry.rotations import Array

DIRECTIONS: Final = {
    "right": (0, 1),
    "left": (0, -1),
    "up": (1, 1),
    "down": (1, -1),
    "back": (2, 1),
    "forward": (2, -1),
}
"""Direction -> canonical axis and its sign."""

RIGHT, UP, BACK = range(3)
_DIRECTION: Final = "(right|left|up|down|back|forward)"
_AXIS: Final = "([+-]?)([xyz])"
_HANDED: Final = re.compile(r"(right|left)[\s_-]*hand(?:ed)?|\b([rl])hs?\b")
_AXIS_FIRST: Final = re.compile(rf"(?<![a-z]){_AXIS}[\s:=_-]*{_DIRECTION}")
_DIRECTION_FIRST: Final = re.compile(rf"{_DIRECTION}(?:wards?)?[\s:=_]*{_AXIS}(?![a-z])")


def matrix_of_axes_text(text: str) -> tuple[Array, bool] | None:
    """Returns the matrix (3, 3) from described axes to canonical ones, and whether the text states their handedness.

    ``None``: the text names no axis. Raises SessionError: no axis is up, one is named twice, or the handedness
    contradicts the axes.
    """
    lower = text.lower()
    handed = _HANDED.search(lower)
    directions = _HANDED.sub(" ", lower)
    named = _named_directions(directions)
    if not named:
        return None
    matrix = np.zeros((3, 3))
    for sign, axis, direction in named:
        row, toward = DIRECTIONS[direction]
        column = "xyz".index(axis)
        if matrix[row].any() or matrix[:, column].any():
            raise SessionError(f"axes {text!r} name an axis or a direction twice; name each once")
        matrix[row, column] = -toward if sign == "-" else toward
    if not matrix[UP].any():
        raise SessionError(f"axes {text!r} do not say which axis is up; write for example 'x forward, y up'")
    is_left = handed is not None and (handed[1] == "left" or handed[2] == "l")
    completed = _completed_matrix(matrix, determinant=-1 if is_left else 1)
    if handed is not None and np.linalg.det(completed) * (-1 if is_left else 1) < 0:
        stated = "left" if is_left else "right"
        raise SessionError(f"axes {text!r} are not {stated}-handed; leave the handedness out, or mend an axis")
    return completed, handed is not None or len(named) == len(matrix)


def _named_directions(text: str) -> list[tuple[str, str, str]]:
    """Sign, axis and direction of each axis in the text; whichever stands first in it stands first in each pair."""
    axis_first, direction_first = _AXIS_FIRST.search(text), _DIRECTION_FIRST.search(text)
    if direction_first and (axis_first is None or direction_first.start() < axis_first.start()):
        return [(sign, axis, direction) for direction, sign, axis in _DIRECTION_FIRST.findall(text)]
    return _AXIS_FIRST.findall(text)


def _completed_matrix(matrix: Array, determinant: int) -> Array:
    """The matrix with its empty rows filled so that it has this determinant; a full one as it is."""
    full = matrix.copy()
    if not full[RIGHT].any() and not full[BACK].any():
        full[RIGHT, _first_free_axis(full)] = 1.0
    for row in (RIGHT, BACK):
        if not full[row].any():
            full[row, _first_free_axis(full)] = 1.0
            full[row] *= determinant * round(float(np.linalg.det(full)))
    return full


def _first_free_axis(matrix: Array) -> int:
    return int(np.flatnonzero(~matrix.any(axis=0))[0])


def axes_as_text(matrix: Array) -> str:
    """Returns the text that `matrix_of_axes_text` reads as this matrix."""
    phrases = []
    for row, toward, direction in ((RIGHT, 1, "right"), (UP, 1, "up"), (BACK, -1, "forward")):
        axis = int(np.flatnonzero(matrix[row])[0])
        phrases.append(f"{'+' if matrix[row, axis] * toward > 0 else '-'}{'xyz'[axis]} {direction}")
    handedness = "right" if np.linalg.det(matrix) > 0 else "left"
    return f"{', '.join(phrases)}, {handedness}-handed"
