"""A collision engine for checking synthetic truth: tests may join what the packages keep apart."""

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from numpy.typing import NDArray

from cdcore import Body, Motion, TriangleMesh, create_detector
from sessions import Session, Status

Answer = Callable[..., NDArray[np.uint8]]


def _poses(session: Session, name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    frames = session.frames
    if name in frames.names:
        column = frames.names.index(name)
        valid = frames.status[:, column] == Status.VALID
        return frames.position[:, column], frames.quaternion_xyzw[:, column], valid
    fixed = session.scene.body(name).fixed
    count = len(frames)
    position = np.tile(np.array(fixed.position), (count, 1))
    return position, np.tile(np.array(fixed.quaternion_xyzw), (count, 1)), np.ones(count, dtype=bool)


def _verdicts(session: Session, pairs: Sequence[tuple[str, str]], rows: slice = slice(None)) -> NDArray[np.uint8]:
    """Verdicts (T, P) of the complete detector for the named pairs."""
    names = sorted({name for pair in pairs for name in pair})
    poses = [_poses(session, name) for name in names]
    motion = Motion.from_quaternions(
        (session.frames.stamp_ns - session.frames.stamp_ns[0])[rows] * 1e-9,
        np.stack([p[0] for p in poses], axis=1)[rows], np.stack([p[1] for p in poses], axis=1)[rows],
        np.stack([p[2] for p in poses], axis=1)[rows],
    )  # fmt: skip
    bodies = [Body(n, TriangleMesh(session.meshes[n].vertices, session.meshes[n].faces)) for n in names]
    numbers = [(names.index(a), names.index(b)) for a, b in pairs]
    detection = create_detector("hybrid", bodies, pairs=numbers).detect(motion)
    order = {tuple(sorted(pair)): k for k, pair in enumerate(detection.pairs.tolist())}
    return detection.verdict[:, [order[tuple(sorted(pair))] for pair in numbers]]


@pytest.fixture(scope="session")
def verdicts() -> Answer:
    return _verdicts
