"""Bullet's list of contacts. The only module that imports ``pybullet``."""

from __future__ import annotations

from typing import Any
from weakref import finalize

import numpy as np

from cdcore.engines.engine_solids import EngineSolid, spread_positions
from cdcore.engines.refusals import mesh_may_be_refused, needs_engine, quiet
from cdcore.numerics import BoolArray, FloatArray, IntArray


class BulletWorld:
    """Bodies of Bullet that are put at poses by hand; no step is ever taken, so none of them moves.

    Bullet keeps a contact while it stays close, and asks no two static bodies. So hulls have a mass, triangle meshes,
    which may have none, are static, and before each look all bodies are taken apart, which drops what was found.
    """

    def __init__(self, solids: list[EngineSolid], _pairs: IntArray, settings: Any) -> None:
        with needs_engine("pybullet", "engines", " on Linux with Python 3.11, elsewhere there is no wheel of it"):
            import pybullet
        self._engine = pybullet
        with quiet():
            self._client = pybullet.connect(pybullet.DIRECT)
        finalize(self, _disconnect, pybullet, self._client)
        with mesh_may_be_refused("Bullet", pybullet.error):
            self._bodies = [self._body(solid, settings.margin_m) for solid in solids]
        self._away, self._unturned = spread_positions(solids)

    def touching(self, translations: FloatArray, rotations: FloatArray, valid: BoolArray) -> list[tuple[int, int]]:
        """Pairs for which Bullet lists a point of contact; see ``EngineWorld.touching``."""
        engine, client = self._engine, self._client
        self._put(range(len(valid)), self._away, self._unturned)
        engine.performCollisionDetection(physicsClientId=client)
        self._put(np.flatnonzero(valid).tolist(), translations, rotations)
        engine.performCollisionDetection(physicsClientId=client)
        return [contact[1:3] for contact in engine.getContactPoints(physicsClientId=client)]

    def _put(self, bodies: Any, translations: FloatArray, rotations: FloatArray) -> None:
        for k in bodies:
            translation, rotation = translations[k].tolist(), rotations[k].tolist()
            self._engine.resetBasePositionAndOrientation(
                self._bodies[k], translation, rotation, physicsClientId=self._client
            )

    def _body(self, solid: EngineSolid, margin: float) -> int:
        engine, client = self._engine, self._client
        shape: dict[str, Any] = {"vertices": solid.corners.tolist()}
        if solid.faces is not None:
            shape |= {"indices": solid.faces.ravel().tolist(), "flags": engine.GEOM_FORCE_CONCAVE_TRIMESH}
        with quiet():
            number = engine.createCollisionShape(engine.GEOM_MESH, physicsClientId=client, **shape)
            mass = 1.0 if solid.faces is None else 0.0
            body = engine.createMultiBody(mass, number, physicsClientId=client)
            engine.changeDynamics(body, -1, collisionMargin=margin, physicsClientId=client)
        return int(body)


def _disconnect(engine: Any, client: int) -> None:
    if engine.isConnected(client):
        engine.disconnect(client)
