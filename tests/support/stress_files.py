"""Reads the files of failing triangle pairs and scenes that ``replay stress --out`` writes."""

import numpy as np

from cdcore import Motion, TriangleMesh
from replay.studies.stress.cases import ARRAYS, NUMBERS, POSES, Cases, FailedScene
from replay.studies.stress.scenes import StressScene, two


def read_cases(path):
    with np.load(path, allow_pickle=False) as file:
        arrays, numbers = ({name: file[name] for name in names} for names in (ARRAYS, NUMBERS))
        words = {name: str(file[name]) for name in ("detector", "relation") if name in file}
    return Cases(**words, **arrays, **{name: int(value) for name, value in numbers.items()})


def read_scenes(path):
    with np.load(path, allow_pickle=False) as file:
        return [_scene(file, f"{k}/") for k in range(len({name.split("/")[0] for name in file if "/" in name}))]


def _scene(file, head):
    meshes = (TriangleMesh(file[f"{head}vertices {k}"], file[f"{head}faces {k}"]) for k in range(2))
    *poses, linked = (file[head + name] for name in POSES)
    name, covers = str(file[f"{head}name"]), str(file[f"{head}covers"])
    scene = StressScene(name, two(*meshes), Motion(*poses, linked=linked), file[f"{head}truth"], covers)
    return FailedScene(scene, file[f"{head}said"])
