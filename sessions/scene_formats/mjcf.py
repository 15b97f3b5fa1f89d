"""MJCF, read by MuJoCo itself: bodies, surfaces, colliders, margins, excluded pairs, and poses of joint angles.

Nested defaults, includes and units are the library's work, and so is forward kinematics. The only module of `sessions`
that imports mujoco.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sessions.errors import SceneSourceError
from sessions.geometry.shapes import make_shape
from sessions.mesh_data import MeshData, concatenated_meshes
from sessions.scene_formats.mjcf_files import check_mjcf
from sessions.scene_formats.safe_files import SceneFiles
from sessions.scene_formats.scene_source import (
    Y_UP_OF_Z_UP,
    Matrix,
    SceneSource,
    SourceBody,
    Surface,
    check_size,
    chosen_surface,
    surface_and_colliders,
)

FIRST_HIDDEN_GROUP: Final = 3
"""MuJoCo's viewer draws geoms of the groups 0 to 2; from 3 on they are colliders by custom."""
ROUND_FACES: Final = 4000
"""Of a capsule, a sphere or an ellipsoid, inscribed in the true shape.

A recorded hand is in contact with a mug in 722, 732, 732, 733 and 733 of 1,900 pair-frames with 200, 500, 1,000, 2,000
and 4,000 faces, with a bowl in 268, 274, 274, 275 and 275. A shift of the mug by up to a micrometre changes none.
"""
Z_OF_Y: Final = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""Lays a shape along +Y along +Z, where MuJoCo has it."""
NOT_TAKEN: Final = {"PLANE": "an endless plane", "HFIELD": "a height field", "SDF": "a signed distance field"}


def mujoco_of() -> Any:
    """The library; SceneSourceError where it is not installed."""
    try:
        import mujoco
    except ImportError as error:
        raise SceneSourceError('MJCF needs MuJoCo; install it: pip install "vrlab-replay[engines]"') from error
    return mujoco


def load_model(path: Path, files: SceneFiles) -> Any:
    """The model of an MJCF file, whose files were all found to lie in the scene's folder before one is read."""
    mujoco = mujoco_of()
    check_mjcf(path, files)
    try:
        return mujoco.MjModel.from_xml_path(str(path))
    except Exception as error:  # of another package: any error means that it cannot be read
        reason = " ".join(str(error).split())
        raise SceneSourceError(f"MuJoCo does not read {path}: {reason}; correct it") from error


def read_mjcf_scene(path: Path, files: SceneFiles, surface: Surface) -> SceneSource:
    """The scene of an MJCF file."""
    return scene_of(load_model(path, files), surface)


def scene_of(model: Any, surface: Surface) -> SceneSource:
    """The scene of a model: every body of which something collides, in the pose of its reference configuration."""
    mujoco = mujoco_of()
    check_size(model.nbody, sum(_faces(model, geom) for geom in range(model.ngeom)))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    names, left_out = body_names(model), list[str]()
    # Geoms of named pairs collide whatever their masks say.
    in_pairs = {*model.pair_geom1.tolist(), *model.pair_geom2.tolist()}
    bodies: dict[str, SourceBody] = {}
    only_drawn = []
    for number, name in enumerate(names):
        geoms = range(*_geoms(model, number).indices(model.ngeom))
        colliding = [geom for geom in geoms if geom in in_pairs or _has_mask(model, geom)]
        left_out += _refused_geoms(model, name, colliding)
        taken = [geom for geom in geoms if _kind(model, geom) not in NOT_TAKEN]
        colliding = [geom for geom in taken if geom in colliding]
        if not colliding:
            only_drawn += [name] if taken else []
            continue
        # Of geoms that collide some are drawn and others hidden: the hidden ones are the pieces of the drawn surface.
        hidden = [geom for geom in colliding if model.geom_group[geom] >= FIRST_HIDDEN_GROUP]
        drawn = [geom for geom in taken if model.geom_group[geom] < FIRST_HIDDEN_GROUP]
        pieces = hidden or colliding
        doubly = [geom for geom in drawn if geom in colliding and hidden]
        if doubly:
            left_out.append(f"the hulls of {len(doubly)} drawn geoms of {name!r}, which collide beside hidden ones")
        drawn_meshes = [geom_mesh(model, geom) for geom in drawn]
        piece_meshes = [geom_mesh(model, geom) for geom in pieces]
        surfaces, solids = surface_and_colliders(drawn_meshes, piece_meshes, surface)
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = data.xmat[number].reshape(3, 3), data.xpos[number]
        bodies[name] = SourceBody(
            name=name,
            mesh=concatenated_meshes(surfaces),
            colliders=solids,
            pose=pose,
            moves=bool(model.body_weldid[number]),
            margin=float(max(model.geom_margin[geom] for geom in pieces)),
            mass=float(model.body_mass[number]) or None,
            surface=chosen_surface(drawn_meshes, piece_meshes, surface) if drawn != pieces else "",
        )
    if only_drawn:
        left_out.append(f"bodies of which nothing collides: {', '.join(only_drawn)}")
    left_out += _soft(model)
    mocap = [name for number, name in enumerate(names) if name in bodies and model.body_mocapid[number] >= 0]
    left_out += [f"the motion of {name!r}, a mocap body: no joint moves it" for name in mocap]
    disable = mujoco.mjtDisableBit
    if model.opt.disableflags & (disable.mjDSBL_CONTACT | disable.mjDSBL_CONSTRAINT):
        left_out.append("the flag that switches all contacts off: pairs are tested")
    return SceneSource("MJCF", bodies, tuple(_excluded_pairs(model, names, bodies)), tuple(left_out), Y_UP_OF_Z_UP)


def body_names(model: Any) -> list[str]:
    """The names of all bodies, the world's first; one without a name is called by its number."""
    return [model.body(number).name or f"body-{number}" for number in range(model.nbody)]


def geom_mesh(model: Any, geom: int) -> MeshData:
    """The surface of a geom in the frame of its body; a round one is inscribed in the true shape."""
    kind, size = _kind(model, geom), model.geom_size[geom]
    if kind == "MESH":
        number = model.geom_dataid[geom]
        first, count = model.mesh_vertadr[number], model.mesh_vertnum[number]
        start, faces = model.mesh_faceadr[number], model.mesh_facenum[number]
        mesh = MeshData(model.mesh_vert[first : first + count], model.mesh_face[start : start + faces])
    elif kind == "BOX":
        mesh = make_shape("box", dict(zip("xyz", (2.0 * size).tolist(), strict=True)))
    elif kind in ("CAPSULE", "CYLINDER"):
        radius, half = size[:2].tolist()
        length = 2.0 * (half + radius) if kind == "CAPSULE" else 2.0 * half
        mesh = make_shape(kind.lower(), {"radius": radius, "length": length}, ROUND_FACES)
        mesh = MeshData(mesh.vertices @ Z_OF_Y.T, mesh.faces)
    else:
        sphere = make_shape("sphere", {"radius": 1.0}, ROUND_FACES)
        scale = size if kind == "ELLIPSOID" else np.full(3, size[0])
        mesh = MeshData(sphere.vertices * scale, sphere.faces)
    return mesh.transformed(_placement(model.geom_pos[geom], model.geom_quat[geom]))


def _faces(model: Any, geom: int) -> int:
    """How many faces `geom_mesh` would make, or more."""
    return int(model.mesh_facenum[model.geom_dataid[geom]]) if _kind(model, geom) == "MESH" else ROUND_FACES


def _placement(position: NDArray[np.float64], quaternion_wxyz: NDArray[np.float64]) -> Matrix:
    mujoco, rotation = mujoco_of(), np.empty(9)
    mujoco.mju_quat2Mat(rotation, quaternion_wxyz)
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation.reshape(3, 3), position
    return matrix


def _kind(model: Any, geom: int) -> str:
    name: str = mujoco_of().mjtGeom(int(model.geom_type[geom])).name
    return name.removeprefix("mjGEOM_")


def _refused_geoms(model: Any, name: str, geoms: Sequence[int]) -> Iterator[str]:
    for geom in geoms:
        word = NOT_TAKEN.get(_kind(model, geom))
        if word is not None:
            yield f"{word} of body {name!r}"


def _soft(model: Any) -> Iterator[str]:
    if model.nflex:
        yield f"soft bodies (flex): {model.nflex}"
    if model.nskin:
        yield f"skins, which are drawn only: {model.nskin}"


def _has_mask(model: Any, geom: int) -> bool:
    return bool(model.geom_contype[geom] or model.geom_conaffinity[geom])


def _excluded_pairs(model: Any, names: Sequence[str], bodies: dict[str, SourceBody]) -> Iterator[tuple[str, str]]:
    """Pairs that MuJoCo never tests: named, of a body and its parent, and of geoms whose masks do not meet.

    Geoms that the model pairs by name are tested in spite of all that.
    """
    numbers = np.array([number for number, name in enumerate(names) if name in bodies], dtype=np.int64)
    welds = model.body_weldid[numbers]
    parents = model.body_weldid[model.body_parentid[welds]]
    excluded = welds[:, None] == welds
    if not model.opt.disableflags & mujoco_of().mjtDisableBit.mjDSBL_FILTERPARENT:
        is_child = parents[:, None] == welds
        excluded |= (is_child | is_child.T) & (welds != 0) & (welds[:, None] != 0)
    types, affinities = (
        np.array([np.bitwise_or.reduce(masks[_geoms(model, number)]) for number in numbers], dtype=np.int64)
        for masks in (model.geom_contype, model.geom_conaffinity)
    )
    meets = types[:, None] & affinities
    excluded |= (meets | meets.T) == 0
    index = {int(number): row for row, number in enumerate(numbers)}
    for mark in model.exclude_signature.tolist():
        _set(excluded, index, (mark >> 16, mark & 0xFFFF), True)
    for geoms in zip(model.pair_geom1.tolist(), model.pair_geom2.tolist(), strict=True):
        _set(excluded, index, tuple(int(model.geom_bodyid[geom]) for geom in geoms), False)
    for first, second in np.argwhere(np.triu(excluded, 1)).tolist():
        yield names[numbers[first]], names[numbers[second]]


def _geoms(model: Any, body: int) -> slice:
    return slice(model.body_geomadr[body], model.body_geomadr[body] + model.body_geomnum[body])


def _set(table: NDArray[np.bool_], index: dict[int, int], pair: tuple[int, ...], value: bool) -> None:
    """Write one pair of bodies into a symmetric table, where both are in it."""
    if all(body in index for body in pair):
        first, second = (index[body] for body in pair)
        table[first, second] = table[second, first] = value
