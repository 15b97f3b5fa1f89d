"""MuJoCo's list of contacts. The only module that imports ``mujoco``.

MuJoCo keeps the corners of a hull as float32, and stops its search for a distance at ``ccd_tolerance``, 1e-6 m.
Source: https://mujoco.readthedocs.io/en/stable/computation.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from cdcore.engines.engine_solids import EngineSolid
from cdcore.engines.refusals import mesh_may_be_refused, needs_engine
from cdcore.numerics import BoolArray, FloatArray, IntArray

CONTACT_BYTES: Final = 1024
"""Room for one contact, some 600 bytes: MuJoCo drops contacts for which its arena has no room."""


class MujocoWorld:
    """Mocap bodies of MuJoCo, one hull each, and an explicit contact pair for each of ``pairs`` (P, 2)."""

    def __init__(self, solids: list[EngineSolid], pairs: IntArray, settings: Any) -> None:
        with needs_engine("mujoco", "engines"):
            import mujoco
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
            spec.add_pair(geomname1=str(first), geomname2=str(second), margin=settings.margin_m, gap=0.0, condim=1)
        spec.memory = 2**22 + len(pairs) * mujoco.mjMAXCONPAIR * CONTACT_BYTES
        with mesh_may_be_refused("MuJoCo", ValueError):
            self._model = spec.compile()
        self._data, self._engine = mujoco.MjData(self._model), mujoco

    def touching(self, translations: FloatArray, rotations: FloatArray, _valid: BoolArray) -> Any:
        """Pairs that MuJoCo lists; the caller leaves out pairs without a pose. See ``EngineWorld.touching``."""
        data = self._data
        data.mocap_pos[:] = translations
        data.mocap_quat[:] = np.roll(rotations, 1, axis=1)
        self._engine.mj_kinematics(self._model, data)
        self._engine.mj_collision(self._model, data)
        return data.contact.geom
