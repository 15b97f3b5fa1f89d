"""Closed meshes of the plain shapes a scene can name: box, sphere, capsule, cylinder; about the origin, +Y along."""

from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sessions.errors import SceneError
from sessions.geometry.rings import even_angles, revolved_rings, sewn
from sessions.geometry.solids import box
from sessions.mesh_data import MeshData

DEFAULT_FACES: Final = 2000
LEAST_FACES: Final = 48
"""A round shape of fewer faces is no longer round; fewer are raised to it."""
MOST_FACES: Final = 1_000_000
"""Twenty times the finest instrument; what a scene asks for is bounded by it."""

SIZES: Final[Mapping[str, tuple[str, ...]]] = {
    "box": ("x", "y", "z"),
    "sphere": ("radius",),
    "capsule": ("radius", "length"),
    "cylinder": ("radius", "length"),
}
"""Shape -> names of its sizes, metres. ``length`` is that of the whole thing, round ends of a capsule included."""


def make_shape(shape: str, size: Mapping[str, float], faces: int = DEFAULT_FACES) -> MeshData:
    """A closed mesh inscribed in the shape: its outermost points lie on the true surface.

    Parameters
    ----------
    shape : a name in ``SIZES``.
    size : the sizes that ``SIZES`` names, metres, above 0.
    faces : about how many faces a round shape gets; a box always has 12.

    Raises ``SceneError``: an unknown shape, a missing or impossible size.
    """
    _check(shape, size, faces)
    if shape == "box":
        return box((size["x"], size["y"], size["z"]))
    outline, sections = _round_outline(shape, size, max(int(faces), LEAST_FACES))
    return sewn(revolved_rings(outline, even_angles(sections), factor=1.0))


def _check(shape: str, size: Mapping[str, float], faces: int) -> None:
    if faces > MOST_FACES:
        raise SceneError(f"a {shape} of {faces} faces; ask for at most {MOST_FACES:,}")
    if shape not in SIZES:
        raise SceneError(f"no shape {shape!r}; there are: {', '.join(SIZES)}")
    missing = [name for name in SIZES[shape] if name not in size]
    if missing:
        raise SceneError(f"a {shape} needs {', '.join(SIZES[shape])}; missing: {', '.join(missing)}")
    bad = [name for name in SIZES[shape] if not 0.0 < size[name] < float("inf")]
    if bad:
        raise SceneError(f"{bad[0]} of a {shape} is {size[bad[0]]}; give metres above 0")


def _round_outline(shape: str, size: Mapping[str, float], faces: int) -> tuple[NDArray[np.float64], int]:
    """Half-section (n, 2) of points (r, y) from the lower to the upper pole, and the sections around."""
    radius = size["radius"]
    if shape == "cylinder":
        half = size["length"] / 2.0
        return np.array([[0.0, -half], [radius, -half], [radius, half], [0.0, half]]), max(8, faces // 4)
    straight = size["length"] - 2.0 * radius if shape == "capsule" else 0.0
    if straight < 0.0:
        raise SceneError(
            f"a capsule of length {size['length']} is shorter than its two round ends of radius {radius}; "
            "give the length of the whole"
        )
    sections = max(8, 2 * round(np.sqrt(faces / 2.0) / 2.0) * 2)
    quarter = max(2, round(faces / (4.0 * sections)))
    angle = np.linspace(0.0, np.pi / 2.0, quarter + 1)
    r, y = radius * np.sin(angle), radius * np.cos(angle)
    r[0], r[-1], y[-1] = 0.0, radius, 0.0  # exact: the cosine of pi / 2 is 6e-17 in doubles
    lower = np.column_stack([r, -y - straight / 2.0])
    upper = np.column_stack([r[::-1], y[::-1] + straight / 2.0])
    return np.concatenate([lower, upper if straight > 0.0 else upper[1:]]), sections
