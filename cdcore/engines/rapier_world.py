"""Rapier's list of contacts. The only module that imports ``rapier3d``."""

from __future__ import annotations

from typing import Any

import numpy as np

from cdcore.engines.engine_solids import EngineSolid
from cdcore.errors import InvalidMeshError, MissingEngineError
from cdcore.numerics import BoolArray, FloatArray


class RapierWorld:
    """Kinematic bodies of Rapier, with contacts between kinematic bodies switched on.

    A contact that Rapier found is updated and not computed again while bodies move little. So each look gets a new
    world; the shapes, which cost the time, are shared.

    Raises
    ------
    MissingEngineError
        rapier3d is not installed.
    InvalidMeshError
        Rapier refuses a mesh; its own words say why.
    """

    def __init__(self, solids: list[EngineSolid], prediction: float) -> None:
        try:
            import rapier3d
        except ImportError as error:
            raise MissingEngineError('rapier3d is not installed; pip install "vrlab-replay[engines]"') from error
        self._engine, self._prediction = rapier3d, prediction
        try:
            self._shapes = [_shape(rapier3d, solid) for solid in solids]
        except rapier3d.RapierError as error:
            words = " ".join(str(error).split())
            raise InvalidMeshError(f"Rapier refuses a mesh, repair it or leave it out: {words}") from error

    def touching(self, places: FloatArray, turns: FloatArray, valid: BoolArray) -> BoolArray:
        """As ``EngineWorld.touching``: pairs with an active contact, which Rapier would push apart."""
        engine, world = self._engine, self._engine.PhysicsWorld()
        world.integration_parameters.normalized_prediction_distance = self._prediction
        body_of = {}
        for k in np.flatnonzero(valid).tolist():
            x, y, z, w = turns[k].tolist()
            pose = engine.Isometry3(engine.Vec3(*places[k].tolist()), engine.Rotation3(w, x, y, z))
            body = world.add_body(engine.RigidBody.kinematic_position_based(position=pose))
            collider = engine.Collider.new(self._shapes[k])
            handle = world.add_collider(collider.active_collision_types(engine.ActiveCollisionTypes.all()), body)
            body_of[handle.index] = k
        world.detect_collisions()
        hits = np.zeros((len(valid), len(valid)), dtype=np.bool_)
        for pair in world.narrow_phase.contact_pairs():
            if pair.has_any_active_contact:
                hits[body_of[pair.collider1.index], body_of[pair.collider2.index]] = True
        return hits


def _shape(engine: Any, solid: EngineSolid) -> Any:
    corners = solid.corners.astype(np.float32)
    if solid.faces is None:
        return engine.SharedShape.convex_hull(corners)
    return engine.SharedShape.trimesh(corners, solid.faces.astype(np.uint32))
