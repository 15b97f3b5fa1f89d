"""Bullet's list of contacts. The only module that imports ``pybullet``."""

from __future__ import annotations

from typing import Any
from weakref import finalize

import numpy as np

from cdcore.engines.engine_solids import EngineSolid, places_apart
from cdcore.engines.quiet import quiet
from cdcore.errors import InvalidMeshError, MissingEngineError
from cdcore.numerics import BoolArray, FloatArray


class BulletWorld:
    """Bodies of Bullet that are put at poses by hand; no step is ever taken, so none of them moves.

    Bullet keeps a contact while it stays close, and asks no two static bodies. So hulls have a mass, triangle meshes,
    which may have none, are static, and before each look all bodies are taken apart, which drops what was found.

    Raises
    ------
    MissingEngineError
        pybullet is not installed.
    InvalidMeshError
        Bullet refuses a mesh; its own words say why.
    """

    def __init__(self, solids: list[EngineSolid], margin: float) -> None:
        try:
            with quiet():  # it prints when it was built
                import pybullet
        except ImportError as error:
            raise MissingEngineError(
                'pybullet is not installed; pip install "vrlab-replay[engines]" on Linux with Python 3.11, '
                "elsewhere there is no wheel of it"
            ) from error
        self._engine = pybullet
        with quiet():
            self._client = pybullet.connect(pybullet.DIRECT)
        finalize(self, _disconnect, pybullet, self._client)
        self._bodies = [self._body(solid, margin) for solid in solids]
        self._away = places_apart(solids)

    def touching(self, places: FloatArray, turns: FloatArray, valid: BoolArray) -> BoolArray:
        """As ``EngineWorld.touching``: pairs for which Bullet lists a point of contact."""
        engine, client = self._engine, self._client
        for body, away in zip(self._bodies, self._away.tolist(), strict=True):
            engine.resetBasePositionAndOrientation(body, (away, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), physicsClientId=client)
        engine.performCollisionDetection(physicsClientId=client)
        for k in np.flatnonzero(valid).tolist():
            place, turn = places[k].tolist(), turns[k].tolist()
            engine.resetBasePositionAndOrientation(self._bodies[k], place, turn, physicsClientId=client)
        engine.performCollisionDetection(physicsClientId=client)
        hits = np.zeros((len(valid), len(valid)), dtype=np.bool_)
        for contact in engine.getContactPoints(physicsClientId=client):
            hits[contact[1], contact[2]] = True
        return hits

    def _body(self, solid: EngineSolid, margin: float) -> int:
        engine, client = self._engine, self._client
        shape: dict[str, Any] = {"vertices": solid.corners.tolist()}
        if solid.faces is not None:
            shape |= {"indices": solid.faces.ravel().tolist(), "flags": engine.GEOM_FORCE_CONCAVE_TRIMESH}
        try:
            with quiet():
                number = engine.createCollisionShape(engine.GEOM_MESH, physicsClientId=client, **shape)
                mass = 1.0 if solid.faces is None else 0.0
                body = engine.createMultiBody(mass, number, physicsClientId=client)
                engine.changeDynamics(body, -1, collisionMargin=margin, physicsClientId=client)
        except engine.error as error:
            raise InvalidMeshError(f"Bullet refuses a mesh, repair it or leave it out: {error}") from error
        return int(body)


def _disconnect(engine: Any, client: int) -> None:
    if engine.isConnected(client):
        engine.disconnect(client)
