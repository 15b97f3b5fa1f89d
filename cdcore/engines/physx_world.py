"""PhysX's list of contacts. The only module that imports ``ovphysx`` and ``ovstage``."""

from __future__ import annotations

import warnings
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final
from weakref import finalize

import numpy as np

from cdcore.engines.engine_solids import EngineSolid, spread_positions
from cdcore.engines.refusals import needs_engine, quiet
from cdcore.errors import InvalidMeshError
from cdcore.numerics import BoolArray, FloatArray, IntArray

STEP: Final = 1 / 60
"""Seconds: the step from which PhysX computes its contact offset where none is given; nothing falls."""

GRAVITY: Final = 9.81
"""Metres per second squared, from which it computes it too."""

DIGITS: Final = 6
"""Of the number of a body in its name."""


class PhysxWorld:
    """Kinematic bodies of PhysX on the processor, with reports between kinematic bodies switched on.

    PhysX updates the contacts of a pair that stays close, so before each look one step with all bodies apart drops
    what was found. A scene comes in as a USD file.

    InvalidMeshError where PhysX has no collider for a mesh.
    """

    def __init__(self, solids: list[EngineSolid], _pairs: IntArray, settings: Any) -> None:
        with needs_engine("ovphysx", "physx"):
            import ovphysx.types
            import ovstage
            from ovphysx.samples.python_samples.schema_support import physx_schema_paths

            schemas = [*map(str, physx_schema_paths()), str(ovphysx.newton_schema_root())]
        self._engine, self._count = ovphysx, len(solids)
        self._away, self._unturned = spread_positions(solids)
        with quiet(), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            if not ovphysx.PhysX.get_cpu_mode():  # it is asked once a process
                ovphysx.PhysX.set_cpu_mode(True)
            self._physx = ovphysx.PhysX()
            self._stage = _attached_scene(
                ovphysx, ovstage, self._physx, schemas, _scene(solids, settings.contact_offset_m)
            )
            self._paths = ovstage.PathDictionary(self._stage)
            self._names = [f"/World/{_name(k)}" for k in range(len(solids))]
            self._put(self._away, self._unturned)
        finalize(self, _close, self._physx, self._stage, self._paths)

    def touching(self, translations: FloatArray, rotations: FloatArray, valid: BoolArray) -> IntArray:
        """Pairs of bodies for which PhysX reports a point of contact; see ``EngineWorld.touching``."""
        self._put(self._away, self._unturned)
        self._physx.step_sync(STEP)
        present = valid[:, None]
        self._put(np.where(present, translations, self._away), np.where(present, rotations, self._unturned))
        self._physx.step_sync(STEP)
        return self._reported_pairs()

    def _put(self, translations: FloatArray, rotations: FloatArray) -> None:
        """Bodies at poses at once, and on their way to them: bodies with no target sleep and report nothing."""
        rows = {3: translations.astype(np.float32), 4: rotations.astype(np.float32)}
        kind = self._engine.types.SimObjectType.RIGID_BODY
        for attributes in (["position", "orientation"], ["kinematicTargetPosition", "kinematicTargetOrientation"]):
            with self._physx.write_sync(kind, attributes) as session:
                for group in session.groups:
                    tensor: Any = group.tensors[0]
                    tensor.assign(rows[tensor.numpy().shape[-1]][self._numbers(group)])
                    session.commit_sync(group)

    def _reported_pairs(self) -> IntArray:
        chosen = self._engine.types.ContactSelection("/World/b*", self._names)
        kind = self._engine.types.SimObjectType.CONTACT_SENSOR
        with self._physx.read_sync(kind, ["filteredContactCount"], contacts=[chosen]) as result:
            hits = np.zeros((self._count, self._count), dtype=np.bool_)
            for group in result.groups:
                counts: Any = group.tensors[0]
                hits[self._numbers(group)] = counts.numpy()  # True where a count is not 0
        return np.argwhere(hits)

    def _numbers(self, group: Any) -> list[int]:
        """The body of each row of a group: PhysX has them in an order of its own."""
        paths = self._paths.get_path_strings(group.prim_list)[group.prim_offset :][: group.prim_count]
        return [int(path[-DIGITS:]) for path in paths]


def _attached_scene(engine: Any, staging: Any, physx: Any, schemas: list[str], scene: str) -> Any:
    if not getattr(engine, "_schemas_registered", False):
        staging.population.register_usd_schemas(schemas)
        engine._schemas_registered = True
    stage = staging.Stage("vrlab-replay")
    with TemporaryDirectory() as folder:
        file = Path(folder) / "scene.usda"
        file.write_text(scene, "utf-8")
        staging.population.open_usd(stage, str(file), ordinal=1, domains=staging.PopulationDomain.ALL)
        stage.advance_write_floor(ordinal=1).wait()
        physx.wait_task(physx.attach_ovstage(stage, read_ordinal=1))
    return stage


def _close(physx: Any, stage: Any, paths: Any) -> None:
    with quiet(), suppress(RuntimeError):  # at the end of the process PhysX may be gone before
        paths.destroy()
        physx.wait_task(physx.detach_ovstage())
        stage.destroy()
        physx.destroy()


def _name(number: int) -> str:
    return f"b{number:0{DIGITS}d}"


def _scene(solids: list[EngineSolid], contact_offset: float | None) -> str:
    """The scene in the words of USD: https://openusd.org/release/api/usd_physics_page_front.html."""
    bodies = "".join(_body(number, solid, contact_offset) for number, solid in enumerate(solids))
    return f"""#usda 1.0
(
    defaultPrim = "World"
    metersPerUnit = 1
    upAxis = "Z"
)
def Xform "World"
{{
    def PhysicsScene "scene" (prepend apiSchemas = ["PhysxSceneAPI"])
    {{
        vector3f physics:gravityDirection = (0, 0, -1)
        float physics:gravityMagnitude = {GRAVITY}
        bool physxScene:reportKinematicKinematicPairs = true
        bool physxScene:enableGPUDynamics = false
        uniform token physxScene:broadphaseType = "SAP"
    }}
{bodies}}}
"""


def _body(number: int, solid: EngineSolid, contact_offset: float | None) -> str:
    offset = "" if contact_offset is None else f"float physxCollision:contactOffset = {contact_offset!r}"
    if solid.faces is None:
        from cdcore.bounding.hull import hull_of

        hull = hull_of(solid.corners)
        if hull is None:
            raise InvalidMeshError("PhysX takes no flat mesh; give it some thickness")
        corners, faces, shape = hull.vertices, hull.faces, "convexHull"
    else:
        corners, faces, shape = solid.corners, solid.faces, "none"
    return f"""
    def Xform "{_name(number)}" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysxContactReportAPI"])
    {{
        bool physics:kinematicEnabled = true
        float physxContactReport:threshold = 0
        def Mesh "shape" (prepend apiSchemas = [
            "PhysicsCollisionAPI", "PhysicsMeshCollisionAPI", "PhysxCollisionAPI"
        ])
        {{
            uniform token physics:approximation = "{shape}"
            {offset}
            int[] faceVertexCounts = [{", ".join(["3"] * len(faces))}]
            int[] faceVertexIndices = [{", ".join(map(str, faces.ravel().tolist()))}]
            point3f[] points = [{", ".join(f"({x!r}, {y!r}, {z!r})" for x, y, z in corners.tolist())}]
        }}
    }}
"""
