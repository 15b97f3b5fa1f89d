"""Engines beside each other in one process: calls interleaved, the least of their times, and every answer compared.

The yardstick is a loop of Python over python-fcl. A ratio holds within one race; seconds of two races do not compare.
"""

from __future__ import annotations

import gc
import time
import zlib
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from cdcore import Body, Motion, TriangleMesh, create_detector
from cdcore.narrow.fcl_meshes import FclMeshes
from replay.bench.workload import BenchWorkload, make_workload

Answer = NDArray[np.int64]
Ask = Callable[[], Answer]


@dataclass(frozen=True)
class Row:
    """One engine in one race; ``speed`` is the yardstick's time over its own."""

    engine: str
    what: str
    faces: int
    seconds: float
    speed: float
    contacts: int
    digest: str
    wrong: int


@dataclass(frozen=True)
class Growth:
    """One size of a session: what ``exact`` took and did; ``work`` and ``stages`` say where the time went."""

    grows: str
    size: int
    pair_frames: int
    seconds: float
    work: dict[str, int]
    stages: dict[str, float]

    def as_json(self) -> dict[str, Any]:
        """Every figure."""
        return asdict(self)


class FclLoop:
    """python-fcl, asked pair by pair and frame by frame; trees are built once."""

    def __init__(self, load: BenchWorkload) -> None:
        self._load = load
        self._meshes = FclMeshes([TriangleMesh(*mesh) for mesh in load.meshes])

    def ask(self, what: str) -> Answer:
        """Face pairs (T, P), or 0 and 1."""
        poses = [(self._load.poses[:, k, :3, :3].copy(), self._load.poses[:, k, :3, 3].copy()) for k in range(self._n)]
        columns: list[Any] = []
        for i, j in self._load.pairs.tolist():
            if what == "bool":
                columns.append(self._meshes.touch_along(i, j, poses[i], poses[j]))
            else:
                columns.append([len(found) for found in self._meshes.faces_along(i, j, poses[i], poses[j])])
        return np.array(columns, dtype=np.int64).T

    @property
    def _n(self) -> int:
        return len(self._load.names)


class OwnExact:
    """The detector ``exact`` through its public path: poses checked in every call, trees kept, answers never."""

    def __init__(self, load: BenchWorkload) -> None:
        self._load = load
        bodies = [Body(name, TriangleMesh(*mesh)) for name, mesh in zip(load.names, load.meshes, strict=True)]
        self._detector = create_detector("exact", bodies, pairs=load.pairs, containment=False)

    def detect(self, what: str) -> Any:
        """The whole ``Detection``."""
        times = np.arange(len(self._load.poses)) / self._load.rate_hz
        return self._detector.detect(Motion.from_matrices(times, self._load.poses), faces=what == "faces")

    def ask(self, what: str) -> Answer:
        """Face pairs (T, P), or 0 and 1."""
        found = self.detect(what)
        return np.asarray(found.face_counts if what == "faces" else found.verdict, dtype=np.int64)


ENGINES: Final[dict[str, Callable[[BenchWorkload], Any]]] = {"python-fcl": FclLoop, "exact": OwnExact}
"""The yardstick first."""


def race(faces: int, what: str, *, frames: int = 5400, repeats: int = 3, seed: int = 0) -> list[Row]:
    """Time all engines on one workload, interleaved after a warm-up."""
    load = make_workload(faces, frames, seed=seed)
    engines = {name: make(load) for name, make in ENGINES.items()}
    answers = {name: engine.ask(what) for name, engine in engines.items()}
    least = dict.fromkeys(engines, np.inf)
    for _ in range(repeats):
        for name, engine in engines.items():
            seconds, answer = timed(partial(engine.ask, what))
            least[name] = min(least[name], seconds)
            if not np.array_equal(answer, answers[name]):
                raise AssertionError(f"{name} changed its answer between two calls; report it with seed {seed}")
    yardstick = next(iter(engines))
    return [
        Row(
            name, what, faces, least[name], least[yardstick] / least[name], int((answers[name] > 0).sum()),
            digest(answers[name]), int((answers[name] != answers[yardstick]).sum()),
        )
        for name in engines
    ]  # fmt: skip


def grow(grows: str, size: int, *, seed: int = 0) -> Growth:
    """Time ``exact`` on a session of one size; ``grows`` is frames, bodies or faces."""
    sizes = {"faces": 500, "frames": 5400, "bodies": 7} | {grows: size}
    load = make_workload(sizes["faces"], sizes["frames"], bodies=sizes["bodies"], seed=seed)
    engine = OwnExact(load)
    engine.ask("bool")
    seconds, found = timed(partial(engine.detect, "bool"))
    stages = {name: float(np.sum(spent)) for name, spent in found.seconds.items()}
    work = {name: int(np.sum(count)) for name, count in found.work.items()}
    return Growth(grows, size, found.verdict.size, seconds, work, stages)


def digest(answer: Answer) -> str:
    """CRC-32 of an answer, eight digits."""
    return f"{zlib.crc32(np.ascontiguousarray(answer, dtype='<i4').tobytes()):08x}"


def timed(call: Callable[[], Any]) -> tuple[float, Any]:
    """Seconds of one call without the cyclic garbage collector, and its value."""
    gc.collect()
    gc.disable()
    try:
        start = time.perf_counter()
        value = call()
        return time.perf_counter() - start, value
    finally:
        gc.enable()
