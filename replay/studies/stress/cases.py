"""Failing triangle pairs in a file: all that is needed to fail again, and to hold that it does not."""

import re
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cdcore import Motion, TriangleMesh
from cdcore.numerics import FloatArray
from cdcore.protocol.detection import Covers
from replay.errors import OutputError, StressError
from replay.studies.stress.scenes import StressScene, two
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


@contextmanager
def stored_arrays(path: Path, what: str) -> Iterator[Any]:
    """The arrays of a file of ``write_arrays``; `StressError` where it does not hold ``what`` is read from it."""
    try:
        with np.load(path, allow_pickle=False) as file:
            yield file
    except (ValueError, KeyError, EOFError, TypeError, AttributeError, zipfile.BadZipFile) as error:
        raise StressError(f"{path} holds no {what} ({error}); give a file that replay stress wrote") from None


def read_cases(path: Path) -> Cases:
    """Read a file of ``write_cases``; `StressError` where it is no such file."""
    with stored_arrays(path, "stress cases") as file:
        row, triangles, truth, verdict = (file[name] for name in ARRAYS)
        family, seed, count = (int(file[name]) for name in NUMBERS)
        detector = str(file["detector"])
        relation = str(file["relation"]) if "relation" in file else ""
    rows = (len(row),)
    if triangles.shape != (*rows, 2, 3, 3) or truth.shape != rows or verdict.shape != rows:
        raise StressError(f"{path} holds arrays of different lengths; give a file that replay stress wrote")
    return Cases(detector, family, seed, count, row, triangles, truth, verdict, relation)


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


def read_scenes(path: Path) -> tuple[FailedScene, ...]:
    """Read a file of ``write_scenes``; `StressError` where it is no such file."""
    with stored_arrays(path, "scenes") as file:
        count = len({name.split("/")[0] for name in file.files if "/" in name})
        return tuple(_scene(file, f"{k}/") for k in range(count))


POSES = ("times", "translations", "rotations", "valid", "linked")


def _arrays(one: FailedScene) -> dict[str, NDArray[np.generic]]:
    scene = one.scene
    arrays = {"name": np.array(scene.name), "covers": np.array(scene.covers), "truth": scene.truth, "said": one.said}
    for k, body in enumerate(scene.bodies):
        arrays |= {f"vertices {k}": body.mesh.vertices, f"faces {k}": body.mesh.faces}
    return arrays | {name: getattr(scene.motion, name) for name in POSES}


def _scene(file: Any, head: str) -> FailedScene:
    first, second = (TriangleMesh(file[f"{head}vertices {k}"], file[f"{head}faces {k}"]) for k in range(2))
    *poses, linked = (file[head + name] for name in POSES)
    covers: Covers = "intervals" if str(file[f"{head}covers"]) == "intervals" else "instants"
    truth, said = (file[head + name].astype(np.uint8) for name in ("truth", "said"))
    motion, name = Motion(*poses, linked=linked), str(file[f"{head}name"])
    return FailedScene(StressScene(name, two(first, second), motion, truth, covers), said)
