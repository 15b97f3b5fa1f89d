"""Files beside the meshes that make an engine take them as colliders: a table of engines, a row each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from replay.advice.engine_knobs import engines
from replay.errors import TradeoffError
from sessions import MeshData

Pieces = Mapping[str, Sequence[MeshData]]
"""Name of a body as a file's -> its pieces, in the axes of the files."""


@dataclass(frozen=True)
class EngineFiles:
    """Files and steps for an engine.

    Parameters
    ----------
    name : in sentences.
    step_hz : of a new project.
    node : name of the node of a piece, of body and number.
    has_mesh : whether a body's own mesh stands beside its pieces, under the body's name.
    extra : name of a file -> its text, made of all pieces.
    steps : sentences: what to do in the engine.
    page : the address that says so.
    file_type : of the files that it reads: ``obj``, as they are, or ``glb``, whose importers turn them.
    """

    name: str
    step_hz: float
    node: str
    extra: Callable[[Pieces], dict[str, str]]
    steps: tuple[str, ...]
    page: str
    has_mesh: bool = False
    file_type: str = "glb"


def engine_files(name: str) -> EngineFiles:
    """The row of an engine. Raises ``TradeoffError`` with the names there are."""
    if name not in ENGINE_FILES:
        raise TradeoffError(f"no engine {name!r}; there are: {', '.join(ENGINE_FILES)}")
    return ENGINE_FILES[name]


UNITY_SCRIPT: Final = """\
// Put this file into Assets/Editor. Select a body with UCX_ nodes below it, then: Tools > Use UCX as Colliders.
using UnityEditor;
using UnityEngine;

public static class ColliderPieces
{
    [MenuItem("Tools/Use UCX as Colliders")]
    private static void Use()
    {
        foreach (var chosen in Selection.gameObjects)
        foreach (var filter in chosen.GetComponentsInChildren<MeshFilter>(true))
        {
            if (!filter.name.StartsWith("UCX_")) continue;
            var piece = Undo.AddComponent<MeshCollider>(filter.gameObject);
            piece.sharedMesh = filter.sharedMesh;
            piece.convex = true;
            var drawn = filter.GetComponent<MeshRenderer>();
            if (drawn != null) Undo.DestroyObjectImmediate(drawn);
            Undo.DestroyObjectImmediate(filter);
        }
    }
}
"""


def _unity(_pieces: Pieces) -> dict[str, str]:
    return {"ColliderPieces.cs": UNITY_SCRIPT}


def _no_files(_pieces: Pieces) -> dict[str, str]:
    return {}


def _mujoco(pieces: Pieces) -> dict[str, str]:
    """An OBJ a piece, which MuJoCo reads and GLB it does not, and the model that has them as geoms."""
    files: dict[str, str] = {}
    assets, bodies = [], []
    for name, solids in pieces.items():
        geoms = []
        for piece_number, solid in enumerate(solids):
            file_name = f"{name}_{piece_number:02d}.obj"
            files[file_name] = _obj(solid)
            assets.append(f'    <mesh name="{name}_{piece_number:02d}" file="{file_name}"/>')
            geoms.append(f'      <geom type="mesh" mesh="{name}_{piece_number:02d}"/>')
        bodies += [f'    <body name="{name}">', "      <freejoint/>", *geoms, "    </body>"]
    # Without bounds MuJoCo refuses bodies of a millimetre: their inertia is below its least number.
    compiler_element = '  <compiler boundmass="1e-9" boundinertia="1e-14"/>'
    lines = [
        '<mujoco model="colliders">',
        compiler_element,
        "  <asset>",
        *assets,
        "  </asset>",
        "  <worldbody>",
        *bodies,
    ]
    return {**files, "colliders.xml": "\n".join([*lines, "  </worldbody>", "</mujoco>", ""])}


def _obj(solid: MeshData) -> str:
    """The corners in the digits that give a float back as it was."""
    corners = [f"v {x!r} {y!r} {z!r}" for x, y, z in solid.vertices.tolist()]
    faces = [f"f {a} {b} {c}" for a, b, c in (solid.faces + 1).tolist()]
    return "\n".join([*corners, *faces, ""])


ENGINE_FILES: Final[dict[str, EngineFiles]] = {
    "unity": EngineFiles(
        name="Unity",
        step_hz=engines()["unity"].step_hz,
        node="UCX_{body}_{number:02d}",
        extra=_unity,
        steps=(
            "Add the package com.unity.cloud.gltfast (glTFast) or UnityGLTF, which read GLB.",
            "Put the folder into Assets, and ColliderPieces.cs into Assets/Editor.",
            "Drag each GLB onto its body with position and rotation 0, select it, then Tools > Use UCX as Colliders.",
            "Unity allows a convex Mesh Collider 255 triangles; no piece has more.",
        ),
        page="https://docs.unity3d.com/6000.1/Documentation/Manual/class-MeshCollider.html",
    ),
    "unreal": EngineFiles(
        name="Unreal Engine",
        step_hz=engines()["unreal"].step_hz,
        node="UCX_{body}_{number:02d}",
        extra=_no_files,
        steps=("Import each GLB whole: the mesh in it takes the UCX_ pieces beside it as its collision.",),
        page="https://dev.epicgames.com/documentation/en-us/unreal-engine/fbx-static-mesh-pipeline-in-unreal-engine",
        has_mesh=True,
    ),
    "godot": EngineFiles(
        name="Godot",
        step_hz=60.0,
        node="{body}_{number:02d}-convcolonly",
        extra=_no_files,
        steps=(
            "Copy the folder into the project: the importer makes a convex shape of each -convcolonly node.",
            "Each node comes as a StaticBody3D; move its shapes under your own body where the body moves.",
        ),
        page="https://docs.godotengine.org/en/stable/tutorials/assets_pipeline/importing_3d_scenes/node_type_customization.html",
    ),
    "mujoco": EngineFiles(
        name="MuJoCo",
        step_hz=engines()["mujoco"].step_hz,
        node="UCX_{body}_{number:02d}",
        extra=_mujoco,
        steps=("Load colliders.xml, or take its mesh assets and geoms into your own model.",),
        page="https://mujoco.readthedocs.io/en/stable/XMLreference.html#body-geom",
        file_type="obj",
    ),
}
"""Name on the command line -> what the engine is given."""
