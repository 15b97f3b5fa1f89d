"""Engines beside each other in one process: calls interleaved, the least of their times, and every answer compared.

The yardstick is a loop of Python over python-fcl. A ratio holds within one race; seconds of two races do not compare.
"""

import gc
import time
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

import numpy as np

from replay.studies.bench.engines import ENGINES, YARDSTICK, Answer, installed_engines
from replay.studies.bench.workload import make_workload

PATIENCE: Final = 3.0
"""Seconds: a peer whose warm-up took longer is not asked again, its warm-up counts."""
TIMED_ALWAYS: Final = (YARDSTICK, "exact")
"""The two engines of the ratio are repeated however long they take."""


@dataclass(frozen=True)
class Row:
    """One engine in one race; ``speed`` is the yardstick's time over its own, ``build`` what its trees took once."""

    engine: str
    what: str
    faces: int
    build: float
    seconds: float
    speed: float
    contacts: int
    digest: str
    wrong: int


def race(faces: int, what: str, *, frames: int = 5400, repeats: int = 3, seed: int = 0) -> list[Row]:
    """Time all installed engines on one workload, interleaved after a warm-up."""
    load = make_workload(faces, frames, seed=seed)
    built = {name: timed(partial(ENGINES[name], load)) for name in installed_engines()}
    first = {name: timed(partial(engine.ask, what)) for name, (_, engine) in built.items()}
    again = [name for name, (seconds, _) in first.items() if name in TIMED_ALWAYS or seconds < PATIENCE]
    least = {name: np.inf if name in again else seconds for name, (seconds, _) in first.items()}
    for _ in range(repeats):
        for name in again:
            seconds, answer = timed(partial(built[name][1].ask, what))
            least[name] = min(least[name], seconds)
            if not np.array_equal(answer, first[name][1]):
                raise AssertionError(f"{name} changed its answer between two calls; report it with seed {seed}")
    truth = first[YARDSTICK][1]
    return [
        Row(
            name, what, faces, built[name][0], least[name], least[YARDSTICK] / least[name], int((answer > 0).sum()),
            digest(answer), int((answer != truth).sum()),
        )
        for name, (_, answer) in first.items()
    ]  # fmt: skip


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
