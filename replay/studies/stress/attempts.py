"""Hard cases that are no scenes: input to be refused before any engine sees it, and answers that must repeat.

Source: section 7.5 of the project's specification, cases 34 to 36 and 43.
"""

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from cdcore import Body, Motion, TriangleMesh, create_detector, join
from cdcore.errors import CollisionCoreError
from replay.studies.stress.peers import known_settings
from replay.studies.stress.scenes import at, two
from replay.studies.stress.solids import ball_mesh, box_mesh

Attempt = Callable[[str], str]
"""Name of a detector -> what is wrong with how it took this, in a few words; empty where nothing is."""

RIGHT: Final = ""


def _bodies() -> tuple[Body, Body]:
    return two(ball_mesh(0.5), box_mesh())


def _refused(motion_of: Callable[[], Motion], mesh_of: Callable[[], TriangleMesh] = box_mesh) -> Attempt:
    def attempt(detector: str) -> str:
        try:
            create_detector(detector, two(ball_mesh(0.5), mesh_of())).detect(motion_of())
        except CollisionCoreError as error:
            return RIGHT if str(error) else "refused without a reason"
        return "taken as if it were sound"

    return attempt


def _quaternion(values: ArrayLike) -> Motion:
    both = np.array([np.asarray(values, dtype=np.float64), np.array([0.0, 0, 0, 1])])
    return Motion.from_quaternions([0.0], np.zeros((1, 2, 3)), both[None])


def _matrix(values: ArrayLike) -> Motion:
    return Motion([0.0], np.zeros((1, 2, 3)), np.array([[values, np.eye(3)]]))


def not_finite() -> Iterator[tuple[str, Attempt]]:
    """34: NaN or infinite numbers in a place, a rotation, a vertex."""
    for value in (np.nan, np.inf, -np.inf):
        spoiled = np.eye(3)
        spoiled[1, 2] = value
        points = box_mesh().vertices.copy()
        points[5, 2] = value
        yield f"{value} in a place", _refused(partial(at, np.array([[value, 0, 0]])))
        yield f"{value} in a rotation", _refused(partial(_matrix, spoiled))
        spoiled_mesh = partial(TriangleMesh, points, box_mesh().faces)
        yield f"{value} in a vertex", _refused(partial(at, np.zeros((1, 3))), spoiled_mesh)


def bad_quaternions() -> Iterator[tuple[str, Attempt]]:
    """35: norms of 0, 1/2 and 1.1 are refused, float32 ones taken, both signs the same."""
    for norm in (0.0, 0.5, 1.1):
        yield f"norm {norm:g}", _refused(partial(_quaternion, [0, 0, 0, norm]))

    def same(detector: str) -> str:
        q = np.array([0.1, 0.2, 0.3, 0.4]) / np.sqrt(0.3)
        one, other = (create_detector(detector, _bodies()).detect(_quaternion(sign * q)) for sign in (1, -1))
        return RIGHT if np.array_equal(one.verdict, other.verdict) else "the other sign is another pose"

    def single(detector: str) -> str:
        q = (np.array([0.1, 0.2, 0.3, 0.4]) / np.sqrt(0.3)).astype(np.float32)
        create_detector(detector, _bodies()).detect(_quaternion(q.astype(np.float64)))
        return RIGHT

    yield "the other sign", same
    yield "float32", single


def not_rigid() -> Iterator[tuple[str, Attempt]]:
    """36: matrices that stretch, shear or reflect."""
    shear = np.eye(3) + np.diag([0.01, 0], 1)
    matrices = {
        "1.01 R": 1.01 * np.eye(3), ".5 R": 0.5 * np.eye(3), "shear": shear, "reflection": np.diag([1.0, 1, -1]),
        "zero": np.zeros((3, 3)),
    }  # fmt: skip
    for name, matrix in matrices.items():
        yield name, _refused(partial(_matrix, matrix))


def _path() -> Motion:
    place = np.linspace(-1.3, 1.3, 97)
    return at(np.stack([place, 0.1 * np.sin(9 * place), np.full(97, 0.2)], axis=1))


def _digest(detector: str, size: int = 0, **settings: Any) -> str | None:
    """Of the answer about a path, in blocks of ``size`` frames if it is above 0."""
    engine = create_detector(detector, _bodies(), **known_settings(detector, settings))
    return (join(list(engine.stream(_path().blocks(size)))) if size else engine.detect(_path())).digest


def _compared(changed: Mapping[str, Any], detector: str) -> str:
    whole = _digest(detector)
    return RIGHT if whole is not None and _digest(detector, **changed) == whole else "another digest"


def repeated() -> Iterator[tuple[str, Attempt]]:
    """43: one digest for any number of threads, where the detector has them, any size of blocks, skipping or not."""
    for size in (1, 10, 64, 4096):
        yield f"blocks of {size}", partial(_compared, {"size": size})
    for threads in (1, 2, 3, 8):
        yield f"{threads} threads", partial(_compared, {"threads": threads})
    yield "without skipping", partial(_compared, {"skip": False})


ATTEMPTS: Final[dict[int, tuple[str, Callable[[], Iterator[tuple[str, Attempt]]]]]] = {
    34: ("non-finite input", not_finite),
    35: ("bad quaternions", bad_quaternions),
    36: ("non-rigid matrices", not_rigid),
    43: ("replay hash", repeated),
}
"""Number of a case -> its name, and its attempts by name."""
