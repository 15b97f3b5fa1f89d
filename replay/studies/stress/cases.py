"""Failing triangle pairs in a file: all that is needed to fail again, and to hold that it does not."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cdcore.numerics import FloatArray
from replay.errors import OutputError
from replay.studies.stress.scenes import StressScene
from sessions.whole_files import whole_file

ARRAYS = ("row", "triangles", "truth", "verdict")
NUMBERS = ("family", "seed", "count")


@dataclass(frozen=True, eq=False)
class Cases:
    """Pairs of one family that one detector answered wrongly or refused."""

    # detector, family, seed, count: where they come from; ``count`` pairs of the family were made with ``seed``
    detector: str
    family: int
    seed: int
    count: int
    row: NDArray[np.int64]  # (k,) which of them these are
    triangles: FloatArray  # (k, 2, 3, 3)
    truth: NDArray[np.bool_]  # (k,) bool, whether they meet
    verdict: NDArray[np.uint8]  # (k,) uint8, what the detector said
    # of which a pair and the same pair moved follow each other, answered differently; empty: of none
    relation: str = ""

    @property
    def file_name(self) -> str:
        """``family-09-hybrid-seed-100.npz``, with ``-swap`` at the end for a relation."""
        words = [f"family-{self.family:02d}", re.sub("[^a-z0-9]+", "-", self.detector.lower()), f"seed-{self.seed}"]
        return "-".join([*words, self.relation] if self.relation else words) + ".npz"


def write_cases(cases: Cases, folder: Path) -> Path:
    """Write the file as ``write_arrays`` does; returns its path."""
    values = {name: np.asarray(getattr(cases, name)) for name in (*ARRAYS, *NUMBERS, "detector", "relation")}
    return write_arrays(values, folder / cases.file_name)


def write_arrays(values: Mapping[str, NDArray[Any]], target: Path) -> Path:
    """Write named arrays as one compressed file, whole or not at all; returns its path.

    Raises OutputError: the folder cannot be written.
    """
    with whole_file(target, OutputError, parents=True) as file:
        np.savez_compressed(file, allow_pickle=False, **dict(values))
    return target


@dataclass(frozen=True, eq=False)
class FailedScene:
    """A scene, and what a detector said of it: as long as the scene's truth."""

    scene: StressScene
    said: NDArray[np.uint8]


def write_scenes(failed: Sequence[FailedScene], detector: str, number: int, seed: int, folder: Path) -> Path:
    """Write ``case-41-hybrid-seed-100.npz`` as ``write_arrays`` does; returns its path."""
    word = re.sub("[^a-z0-9]+", "-", detector.lower())
    target = folder / f"case-{number:02d}-{word}-seed-{seed}.npz"
    values: dict[str, NDArray[np.generic]] = {"detector": np.array(detector), "case": np.array(number)}
    for k, one in enumerate(failed):
        values |= {f"{k}/{name}": array for name, array in _arrays(one).items()}
    return write_arrays(values, target)


POSES = ("times", "translations", "rotations", "valid", "linked")


def _arrays(one: FailedScene) -> dict[str, NDArray[np.generic]]:
    scene = one.scene
    arrays = {"name": np.array(scene.name), "covers": np.array(scene.covers), "truth": scene.truth, "said": one.said}
    for k, body in enumerate(scene.bodies):
        arrays |= {f"vertices {k}": body.mesh.vertices, f"faces {k}": body.mesh.faces}
    return arrays | {name: getattr(scene.motion, name) for name in POSES}
