"""MuJoCo's list of contacts. The only module that imports ``mujoco``.

MuJoCo keeps the corners of a hull as float32, and stops its search for a distance at ``ccd_tolerance``, 1e-6 m.
Source: https://mujoco.readthedocs.io/en/stable/computation.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from cdcore.engines.engine_solids import EngineSolid
from cdcore.errors import InvalidMeshError, MissingEngineError
from cdcore.numerics import BoolArray, FloatArray, IntArray

CONTACT_BYTES: Final = 1024
"""Room for one contact, some 600 bytes: MuJoCo drops contacts for which its arena has no room."""


class MujocoWorld:
    """Mocap bodies of MuJoCo, one hull each, and an explicit contact pair for each of ``pairs`` (P, 2).

    Raises
    ------
    MissingEngineError
        MuJoCo is not installed.
    InvalidMeshError
        MuJoCo refuses a mesh; its own words say why.
    """

    def __init__(self, solids: list[EngineSolid], pairs: IntArray, margin: float) -> None:
        try:
            import mujoco
        except ImportError as error:
            raise MissingEngineError('mujoco is not installed; pip install "vrlab-replay[engines]"') from error
        spec = mujoco.MjSpec()
        shell, kind = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL, mujoco.mjtGeom.mjGEOM_MESH
        for number, solid in enumerate(solids):
            # It finds no mesh again whose name holds a line end.
            name = repr(solid.name)[1:-1]
            # Corners without faces: MuJoCo closes them by their hull, so that an open mesh has a middle too.
            spec.add_mesh(name=name, uservert=solid.corners.ravel(), inertia=shell)
            body = spec.worldbody.add_body(mocap=True)
            body.add_geom(name=str(number), type=kind, meshname=name, contype=0, conaffinity=0)
        for first, second in pairs.tolist():
            spec.add_pair(geomname1=str(first), geomname2=str(second), margin=margin, gap=0.0, condim=1)
        spec.memory = 2**22 + len(pairs) * mujoco.mjMAXCONPAIR * CONTACT_BYTES
        try:
            self._model = spec.compile()
        except ValueError as error:
            words = " ".join(str(error).split())
            raise InvalidMeshError(f"MuJoCo refuses a mesh, repair it or leave it out: {words}") from error
        self._data, self._engine = mujoco.MjData(self._model), mujoco

    def touching(self, places: FloatArray, turns: FloatArray, valid: BoolArray) -> BoolArray:
        """As ``EngineWorld.touching``: pairs that MuJoCo lists; a pair without a pose is the caller's to leave out."""
        data = self._data
        data.mocap_pos[:] = places
        data.mocap_quat[:] = np.roll(turns, 1, axis=1)
        self._engine.mj_kinematics(self._model, data)
        self._engine.mj_collision(self._model, data)
        hits = np.zeros((len(valid), len(valid)), dtype=np.bool_)
        first, second = data.contact.geom.T
        hits[first, second] = True
        return hits
