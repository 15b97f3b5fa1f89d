"""Failing scenes in a file: bodies, poses, truth and what was said, all that is needed to fail again."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cdcore import Body, Motion, TriangleMesh
from cdcore.protocol.detection import Covers
from replay.studies.stress.cases import stored_arrays, write_arrays
from replay.studies.stress.scenes import Scene


@dataclass(frozen=True, eq=False)
class FailedScene:
    """A scene, and what a detector said of it: as long as the scene's truth."""

    scene: Scene
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
        return tuple(_scene({name: file[f"{k}/{name}"] for name in _NAMES}) for k in range(count))


_NAMES = (
    "name", "covers", "truth", "said", "vertices 0", "faces 0", "vertices 1", "faces 1",
    "times", "translations", "rotations", "valid", "linked",
)  # fmt: skip


def _arrays(one: FailedScene) -> dict[str, NDArray[np.generic]]:
    scene, motion = one.scene, one.scene.motion
    meshes = [body.mesh for body in scene.bodies]
    values = (
        np.array(scene.name), np.array(scene.covers), scene.truth, one.said, meshes[0].vertices, meshes[0].faces,
        meshes[1].vertices, meshes[1].faces, motion.times, motion.translations, motion.rotations, motion.valid,
        motion.linked,
    )  # fmt: skip
    return dict(zip(_NAMES, values, strict=True))


def _scene(values: dict[str, NDArray[np.generic]]) -> FailedScene:
    bodies = [
        Body(name, TriangleMesh(values[f"vertices {k}"], values[f"faces {k}"]))
        for k, name in enumerate(("first", "second"))
    ]
    poses = (values[name] for name in ("times", "translations", "rotations", "valid"))
    motion = Motion(*poses, linked=values["linked"])
    covers: Covers = "intervals" if str(values["covers"]) == "intervals" else "instants"
    truth, said = (values[name].astype(np.uint8) for name in ("truth", "said"))
    return FailedScene(Scene(str(values["name"]), (bodies[0], bodies[1]), motion, truth, covers), said)
