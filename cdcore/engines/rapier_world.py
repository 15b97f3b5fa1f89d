"""Rapier's list of contacts. The only module that imports ``rapier3d``."""

from __future__ import annotations

from typing import Any

import numpy as np

from cdcore.engines.engine_solids import EngineSolid
from cdcore.engines.refusals import mesh_may_be_refused, needs_engine
from cdcore.numerics import BoolArray, FloatArray, IntArray


class RapierWorld:
    """Kinematic bodies of Rapier, with contacts between kinematic bodies switched on.

    A contact that Rapier found is updated and not computed again while bodies move little. So each look gets a new
    world; the shapes, which cost the time, are shared.
    """

    def __init__(self, solids: list[EngineSolid], _pairs: IntArray, settings: Any) -> None:
        with needs_engine("rapier3d", "engines"):
            import rapier3d
        self._engine, self._prediction = rapier3d, settings.prediction_m
        with mesh_may_be_refused("Rapier", rapier3d.RapierError):
            self._shapes = [_shape(rapier3d, solid) for solid in solids]

    def touching(self, translations: FloatArray, rotations: FloatArray, valid: BoolArray) -> list[tuple[int, int]]:
        """Pairs with an active contact, which Rapier would push apart; see ``EngineWorld.touching``."""
        engine, world = self._engine, self._engine.PhysicsWorld()
        world.integration_parameters.normalized_prediction_distance = self._prediction
        body_of = {}
        for k in np.flatnonzero(valid).tolist():
            x, y, z, w = rotations[k].tolist()
            pose = engine.Isometry3(engine.Vec3(*translations[k].tolist()), engine.Rotation3(w, x, y, z))
            body = world.add_body(engine.RigidBody.kinematic_position_based(position=pose))
            collider = engine.Collider.new(self._shapes[k])
            handle = world.add_collider(collider.active_collision_types(engine.ActiveCollisionTypes.all()), body)
            body_of[handle.index] = k
        world.detect_collisions()
        return [
            (body_of[pair.collider1.index], body_of[pair.collider2.index])
            for pair in world.narrow_phase.contact_pairs()
            if pair.has_any_active_contact
        ]


def _shape(engine: Any, solid: EngineSolid) -> Any:
    corners = solid.corners.astype(np.float32)
    if solid.faces is None:
        return engine.SharedShape.convex_hull(corners)
    return engine.SharedShape.trimesh(corners, solid.faces.astype(np.uint32))
