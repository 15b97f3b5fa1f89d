"""The meshes a scene declares: files beside it, plain shapes, instruments of the bench."""

from pathlib import Path

from sessions.errors import SceneError, SessionError
from sessions.geometry.shapes import DEFAULT_FACES, make_shape
from sessions.mesh_data import MeshData
from sessions.model.scene import Scene, SceneBody

INSTRUMENT_FACES = 5000


def scene_meshes(scene: Scene, folder: str | Path = ".") -> dict[str, MeshData]:
    """Name -> mesh of every body that declares one; paths are relative to ``folder``.

    A SceneError names the body and what is wrong with its mesh.
    """
    meshes = {}
    for body in scene.bodies:
        try:
            mesh = _mesh(body, Path(folder))
        except (SessionError, TypeError, ValueError) as error:  # the latter two from options of the wrong type
            raise SceneError(f"{scene.name or 'scene'}: body {body.id!r}: {error}") from None
        if mesh is not None:
            meshes[body.id] = mesh
    return meshes


def _mesh(body: SceneBody, folder: Path) -> MeshData | None:
    if body.mesh:
        from sessions.meshes.mesh_files import load_mesh

        return load_mesh(folder / body.mesh, body.scale)
    if body.shape:
        return make_shape(body.shape, body.size, int(body.extra.get("faces", DEFAULT_FACES)))
    if body.instrument:
        from sessions.glassware.catalogue import make_instrument

        faces = int(body.extra.get("faces", INSTRUMENT_FACES))
        options = body.extra.get("options", {})
        taken = {"name", "faces"} & options.keys()
        if taken:
            raise SceneError(f"options hold {min(taken)}, which is no option; write it beside instrument")
        return make_instrument(body.instrument, faces, **options).mesh
    return None
