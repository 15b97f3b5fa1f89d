"""Convex hulls in MuJoCo, and which pairs of them are in its list of contacts. The only module that imports ``mujoco``.

MuJoCo makes the hull of a mesh itself, keeps its corners as float32, and stops its search for a distance at
``ccd_tolerance``, 1e-6 m. Source: https://mujoco.readthedocs.io/en/stable/computation.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from cdcore.errors import InvalidMeshError, MissingEngineError
from cdcore.mesh import TriangleMesh
from cdcore.numerics import BoolArray, FloatArray, IntArray
from cdcore.protocol import Body

SHEET: Final = 1e-5
"""Metres: MuJoCo refuses a flat mesh and asks for a thin box; a mesh thinner than this gets this thickness."""

CONTACT_BYTES: Final = 1024
"""Room for one contact, some 600 bytes: MuJoCo drops contacts for which its arena has no room."""


class MujocoHulls:
    """One mocap body with one mesh a body, and an explicit contact pair for each of ``pairs`` (P, 2).

    Bodies stand in the order of their names, so that neither their order nor that of a pair changes an answer.

    Raises
    ------
    MissingEngineError
        MuJoCo is not installed.
    InvalidMeshError
        MuJoCo refuses a mesh; its own words say why.
    """

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, margin: float) -> None:
        try:
            import mujoco
        except ImportError as error:
            raise MissingEngineError('mujoco is not installed; pip install "vrlab-replay[engines]"') from error
        self._order = np.array(sorted(range(len(bodies)), key=lambda k: bodies[k].name), dtype=np.int64)
        geom_of = np.argsort(self._order)
        asked = np.sort(geom_of[pairs], axis=1)
        try:
            self._model = _model(mujoco, [bodies[k] for k in self._order], asked.tolist(), margin)
        except ValueError as error:
            words = " ".join(str(error).split())
            raise InvalidMeshError(f"MuJoCo refuses a mesh, repair it or leave it out: {words}") from error
        self._data, self._engine, self._count = mujoco.MjData(self._model), mujoco, len(pairs)
        self._column = np.zeros((len(bodies), len(bodies)), dtype=np.int64)
        self._column[asked[:, 0], asked[:, 1]] = self._column[asked[:, 1], asked[:, 0]] = np.arange(len(pairs))

    def touch(self, rotations: FloatArray, translations: FloatArray, valid: BoolArray) -> BoolArray:
        """Which pairs are in contact (P,), at poses (N, 3, 3) and (N, 3); a body that is not ``valid`` stays."""
        engine, data = self._engine, self._data
        for mocap, body in enumerate(self._order.tolist()):
            if valid[body]:
                data.mocap_pos[mocap] = translations[body]
                engine.mju_mat2Quat(data.mocap_quat[mocap], rotations[body].ravel())
        engine.mj_kinematics(self._model, data)
        engine.mj_collision(self._model, data)
        hits = np.zeros(self._count, dtype=np.bool_)
        found = data.contact.geom
        hits[self._column[found[:, 0], found[:, 1]]] = True
        return hits


def _model(mujoco: Any, bodies: Sequence[Body], pairs: Sequence[tuple[int, int]], margin: float) -> Any:
    """Bodies that are moved by hand; equal meshes share one hull, and only ``pairs`` of them collide."""
    spec = mujoco.MjSpec()
    shell, kind = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL, mujoco.mjtGeom.mjGEOM_MESH
    hulls: dict[str, tuple[str, FloatArray]] = {}
    for number, body in enumerate(bodies):
        key = body.mesh.content_hash
        if key not in hulls:
            corners = _corners(body.mesh)
            # MuJoCo takes corners as float32, whose spacing grows with the distance from the origin.
            # It finds no mesh again whose name holds a line end.
            hulls[key] = repr(body.name)[1:-1], (corners.min(axis=0) + corners.max(axis=0)) / 2
            # Corners without faces: MuJoCo closes them by their hull, so that an open mesh has a middle too.
            spec.add_mesh(name=hulls[key][0], uservert=(corners - hulls[key][1]).ravel(), inertia=shell)
        mesh, middle = hulls[key]
        mocap = spec.worldbody.add_body(mocap=True)
        mocap.add_geom(name=str(number), type=kind, meshname=mesh, pos=middle, contype=0, conaffinity=0)
    for low, high in pairs:
        spec.add_pair(geomname1=str(low), geomname2=str(high), margin=margin, gap=0.0, condim=1)
    spec.memory = 2**22 + len(pairs) * mujoco.mjMAXCONPAIR * CONTACT_BYTES
    return spec.compile()


def _corners(mesh: TriangleMesh) -> FloatArray:
    """The vertices that faces use, (n, 3); those of a sheet or a needle on both sides of it."""
    points = mesh.referenced_vertices
    about = points - points.mean(axis=0)
    for axis in np.linalg.eigh(about.T @ about)[1].T:
        if np.ptp(points @ axis) < SHEET:
            points = np.concatenate([points - SHEET / 2 * axis, points + SHEET / 2 * axis])
    return points
