"""USD with UsdPhysics: rigid bodies with their colliders, filtered pairs, contact offsets, and poses over time.

A prim with an enabled RigidBodyAPI is a body; the colliders of it and below it, down to the next body or to a prim that
resets its transforms, are its compound shape. A collider below no body stands still, as a body of its own prim.

Source: the UsdPhysics schema of OpenUSD; ``physxCollision`` attributes are those of NVIDIA's PhysxSchema.
"""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sessions.errors import MeshFileError, SceneError, SceneSourceError
from sessions.mesh_data import MeshData, concatenated_meshes
from sessions.meshes.glb_tree import rigid_of
from sessions.scene_formats.body_names import distinct_names, repeated_names
from sessions.scene_formats.safe_files import SceneFiles
from sessions.scene_formats.scene_source import (
    Y_UP_OF_Z_UP,
    Matrix,
    SceneSource,
    SourceBody,
    Surface,
    check_size,
    chosen_surface,
    surface_meshes,
)
from sessions.scene_formats.usd_layers import MOST_PRIMS, open_stage, usd_errors
from sessions.scene_formats.usd_shapes import TAKEN, drawn_mesh, solid_mesh

Y_UP_OF_X_UP: Final = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
ROTATIONS: Final = {"Y": np.eye(3), "Z": Y_UP_OF_Z_UP, "X": Y_UP_OF_X_UP}
"""Axis that points up in a stage -> rotation of its world to +Y up."""
SOFT: Final = ("Deformable", "SoftBody", "Particle", "Cloth")
"""Words in the names of schemas of bodies that bend or flow."""
TRIGGER: Final = "PhysxTriggerAPI"
CONTACT_OFFSET, REST_OFFSET = "physxCollision:contactOffset", "physxCollision:restOffset"
SELF_COLLISIONS: Final = "physxArticulation:enabledSelfCollisions"
MOST_POSES: Final = 20_000_000
"""Of all bodies and times: 1.1 GB. Every body that moves is posed at the samples of all."""
FRAME_TOLERANCE: Final = 1e-6
"""Of a frame: time samples that lie a frame apart differ by rounding."""
POSED_BETWEEN: Final = "poses between time samples as USD interpolates them, at the frames of the scene"


@dataclass(frozen=True)
class UsdMotion:
    """Poses of a body over time: ``seconds`` (T,), ``poses`` (T, 4, 4) in the axes of the stage, metres."""

    seconds: NDArray[np.float64]
    poses: NDArray[np.float64]


def read_usd_scene(path: Path, files: SceneFiles, surface: Surface) -> SceneSource:
    """The scene of a USD file, each body in the pose of its first sample.

    Raises ``SceneSourceError``: usd-core is not installed or does not read it, or a layer is outside the folder.
    """
    return read_usd_motion(path, files, surface)[0]


def read_usd_motion(
    path: Path, files: SceneFiles, surface: Surface, *, is_trial: bool = False
) -> tuple[SceneSource, dict[str, UsdMotion]]:
    """The scene of a USD file and the motion of each body whose transforms have time samples.

    ``is_trial``: as of `open_stage`. Raises as `read_usd_scene`.
    """
    with usd_errors(path) as usd:
        stage, missing = open_stage(usd, path, files, is_trial=is_trial)
        reader = _Reader(usd, stage, surface, missing)
        scene, motions = reader.scene(), reader.motions()
        notes = (*scene.notes, POSED_BETWEEN) if reader.are_posed_between else scene.notes
        return replace(scene, left_out=tuple(dict.fromkeys(reader.left_out)), notes=notes), motions


@dataclass
class _Geometry:
    """The prims of a body: ``drawn`` and ``colliding``."""

    prim: Any
    drawn: list[Any] = field(default_factory=list)
    colliding: list[Any] = field(default_factory=list)


class _Reader:
    def __init__(self, usd: Any, stage: Any, surface: Surface, left_out: list[str]) -> None:
        self._usd, self._stage, self._surface, self.left_out = usd, stage, surface, left_out
        self._time = usd.Usd.TimeCode.EarliestTime()
        self._poses = usd.UsdGeom.XformCache(self._time)
        self._unit = float(usd.UsdGeom.GetStageMetersPerUnit(stage))
        if not 0.0 < self._unit < np.inf:
            raise SceneSourceError(f"metersPerUnit is {self._unit}; give metres above 0")
        self._kilograms = float(usd.UsdPhysics.GetStageKilogramsPerUnit(stage))
        self._geometry_of: dict[Any, _Geometry] = {}
        self._names: dict[Any, str] = {}
        self._faces = 0
        self.are_posed_between = False
        """Whether bodies are posed at frames that are no time sample of any."""

    def scene(self) -> SceneSource:
        """Every body that has a collider, in the order of the stage."""
        joints = self._collect()
        check_size(len(self._geometry_of))
        self._names = dict(
            zip(self._geometry_of, distinct_names([_steps(path) for path in self._geometry_of]), strict=True)
        )
        bodies = {}
        for path, geometry in self._geometry_of.items():
            body = self._body(geometry, self._names[path])
            if body is not None:
                bodies[body.name] = body
        pairs = dict.fromkeys([*self._filtered_pairs(), *self._jointed_pairs(joints)])
        named = ((self._names[first], self._names[second]) for first, second in pairs)
        up = str(self._usd.UsdGeom.GetStageUpAxis(self._stage))
        return SceneSource(
            format="USD",
            bodies=bodies,
            excluded=tuple(pair for pair in named if bodies.keys() >= {*pair}),
            rotation=ROTATIONS[up],
            notes=tuple(self._notes(up)),
        )

    def motions(self) -> dict[str, UsdMotion]:
        """The motion of each body by name; a body without time samples has none."""
        own_times = {path: self._times_of(geometry.prim) for path, geometry in self._geometry_of.items()}
        moving = [path for path, codes in own_times.items() if codes]
        if not moving:
            return {}
        rate = float(self._stage.GetTimeCodesPerSecond())
        if not 0.0 < rate < np.inf:
            raise SceneSourceError(f"timeCodesPerSecond is {rate}; give a number above 0")
        codes = self._sampled_codes(sorted({code for path in moving for code in own_times[path]}), len(moving))
        poses: dict[Any, list[Matrix]] = {path: [] for path in moving}
        scales: dict[Any, list[NDArray[np.float64]]] = {path: [] for path in moving}
        for code in codes:
            self._poses.SetTime(self._usd.Usd.TimeCode(code))
            for path in moving:
                pose = self._pose(self._geometry_of[path].prim)
                poses[path].append(self._frame(pose, path))
                scales[path].append(np.linalg.norm(pose[:3, :3], axis=0))
        for path, rows in scales.items():
            if not np.allclose(rows, rows[0], rtol=1e-6):
                self.left_out.append(f"the scale of {self._names[path]!r}, which changes")
        return {self._names[path]: UsdMotion(np.array(codes) / rate, np.array(rows)) for path, rows in poses.items()}

    def _sampled_codes(self, keys: Sequence[float], bodies: int) -> list[float]:
        """Time codes at which bodies are posed: the time samples of all, and frames of the scene where none is.

        A pose between two samples is defined by USD, so a body that is keyed at its start and end is there all along.
        """
        frame = float(self._stage.GetTimeCodesPerSecond()) / float(self._stage.GetFramesPerSecond() or np.inf)
        steps = np.diff(keys)
        with np.errstate(divide="ignore", over="ignore"):
            parts = np.maximum(np.ceil(steps / frame - FRAME_TOLERANCE), 1.0) if frame > 0.0 else np.ones(len(steps))
        if bodies * (float(parts.sum()) + 1.0) > MOST_POSES:
            raise SceneSourceError(f"the scene has more than {MOST_POSES:,} poses; shorten it")
        codes = [
            float(start + part * step / count)
            for start, step, count in zip(keys, steps.tolist(), parts.astype(np.int64).tolist(), strict=False)
            for part in range(count)
        ]
        self.are_posed_between = len(codes) + 1 > len(keys)
        return [*codes, keys[-1]]

    def _collect(self) -> list[Any]:
        """Sort the prims of the stage by the body that they belong to; the joints of the stage."""
        usd, joints = self._usd, []
        prims = iter(usd.Usd.PrimRange.Stage(self._stage, usd.Usd.TraverseInstanceProxies()))
        for number, prim in enumerate(prims):
            if number > MOST_PRIMS:
                raise SceneSourceError(f"the scene has more than {MOST_PRIMS:,} prims; leave out what does not matter")
            path = str(prim.GetPath())
            schemas = prim.GetPrimTypeInfo().GetAppliedAPISchemas()
            if any(word in schema for schema in schemas for word in SOFT):
                self.left_out.append(f"the soft body {path!r}")
                prims.PruneChildren()
            elif prim.IsA(usd.UsdGeom.PointInstancer):
                self.left_out.append(f"the instances of point instancer {path!r}")
                prims.PruneChildren()
            elif prim.IsA(usd.UsdPhysics.Joint):
                joints.append(prim)
            else:
                self._add(prim, is_trigger=TRIGGER in schemas)
        self._geometry_of = {
            path: geometry for path, geometry in self._geometry_of.items() if geometry.drawn or geometry.colliding
        }
        if joints:
            kinds = Counter(prim.GetTypeName() for prim in joints)
            named = ", ".join(f"{count} {kind}" for kind, count in kinds.items())
            self.left_out.append(f"joints ({named}): only time samples or a recording move bodies")
        return joints

    def _add(self, prim: Any, *, is_trigger: bool) -> None:
        """Add a prim to the geometry of its body, or name why it cannot be taken."""
        path, usd = str(prim.GetPath()), self._usd
        collides = prim.HasAPI(usd.UsdPhysics.CollisionAPI) and self._is_enabled(prim)
        if collides and is_trigger:
            self.left_out.append(f"the trigger {path!r}")
            return
        if self._is_body(prim):
            self._geometry_of.setdefault(prim.GetPath(), _Geometry(prim))
        if not prim.IsA(usd.UsdGeom.Gprim):
            if collides:
                self.left_out.append(f"the collider {path!r}: a shape {str(prim.GetTypeName())!r}")
            return
        owner = self._owner(prim) or (prim if collides else None)
        if owner is None:
            return
        geometry = self._geometry_of.setdefault(owner.GetPath(), _Geometry(owner))
        if collides:
            geometry.colliding.append(prim)
        if self._is_drawn(prim):
            geometry.drawn.append(prim)

    def _is_enabled(self, prim: Any) -> bool:
        return bool(self._usd.UsdPhysics.CollisionAPI(prim).GetCollisionEnabledAttr().Get(self._time))

    def _is_body(self, prim: Any) -> bool:
        if not prim.HasAPI(self._usd.UsdPhysics.RigidBodyAPI):
            return False
        return bool(self._usd.UsdPhysics.RigidBodyAPI(prim).GetRigidBodyEnabledAttr().Get(self._time))

    def _is_drawn(self, prim: Any) -> bool:
        image, tokens = self._usd.UsdGeom.Imageable(prim), self._usd.UsdGeom.Tokens
        is_visible = image.ComputeVisibility(self._time) != tokens.invisible
        has_surface = prim.GetTypeName() in TAKEN
        return has_surface and is_visible and image.ComputePurpose() in (tokens.default_, tokens.render)

    def _owner(self, prim: Any) -> Any:
        """The body that a prim is a part of; ``None``: it hangs below none."""
        while prim and not prim.IsPseudoRoot():
            if self._is_body(prim):
                return prim
            xform = self._usd.UsdGeom.Xformable(prim)
            if xform and xform.GetResetXformStack():
                return None
            prim = prim.GetParent()
        return None

    def _pose(self, prim: Any) -> Matrix:
        """From the prim's frame to the world, (4, 4), in units of the stage; of a column on its right."""
        return np.array(self._poses.GetLocalToWorldTransform(prim)).T

    def _frame(self, pose: Matrix, path: Any) -> Matrix:
        """The rigid part of a pose, in metres."""
        if not np.isfinite(pose).all() or np.linalg.det(pose[:3, :3]) == 0.0:
            raise SceneSourceError(f"{path} has a pose that is no number, or a scale of 0; correct it")
        frame = rigid_of(pose)
        frame[:3, 3] *= self._unit
        return frame

    def _body(self, geometry: _Geometry, name: str) -> SourceBody | None:
        frame = self._frame(self._pose(geometry.prim), geometry.prim.GetPath())
        to_body = np.asarray(np.linalg.inv(frame), dtype=np.float64)
        drawn = [mesh for prim in geometry.drawn if (mesh := self._mesh(prim, to_body, solid=False)) is not None]
        solids = {prim: self._mesh(prim, to_body, solid=True) for prim in geometry.colliding}
        colliding = [solid for solid in solids.values() if solid is not None]
        if not geometry.colliding or not (drawn or colliding):
            if not geometry.colliding:
                self.left_out.append(f"the body {name!r}, of which nothing collides")
            return None
        surfaces = surface_meshes(drawn, colliding, self._surface)
        margins = [self._offset(prim, CONTACT_OFFSET) for prim in geometry.colliding]
        if any(self._offset(prim, REST_OFFSET) for prim in geometry.colliding):
            self.left_out.append(f"the rest offset of {name!r}")
        self._note_changes(geometry, name)
        # What is drawn and what collides may be the same prims.
        kind = "" if geometry.drawn == geometry.colliding else chosen_surface(drawn, colliding, self._surface)
        return SourceBody(
            name=name,
            mesh=concatenated_meshes(surfaces),
            colliders=tuple(colliding),
            pose=frame,
            moves=self._is_body(geometry.prim),
            margin=max(margins),
            mass=self._mass(geometry.prim),
            surface=kind,
        )

    def _mesh(self, prim: Any, to_body: Matrix, *, solid: bool) -> MeshData | None:
        """The mesh of a prim that is drawn or collides, in the frame of its body; ``None``: named as not taken."""
        pose, path = self._pose(prim), str(prim.GetPath())
        try:
            rigid = self._frame(pose, path)
            if solid:
                mirror = np.sign(np.linalg.det(pose[:3, :3]))
                scale = self._unit * np.linalg.norm(pose[:3, :3], axis=0) * [mirror, 1.0, 1.0]
                mesh = solid_mesh(self._usd, prim, self._time, scale, self.left_out).transformed(to_body @ rigid)
            else:
                world = np.vstack([self._unit * pose[:3], pose[3:]])
                mesh = drawn_mesh(self._usd, prim, self._time).transformed(to_body @ world)
        except (MeshFileError, SceneError, SceneSourceError) as error:
            self.left_out.append(f"{'the collider' if solid else 'the surface'} {path!r}: {error}")
            return None
        self._faces += len(mesh.faces)
        check_size(0, self._faces)
        return mesh

    def _offset(self, prim: Any, name: str) -> float:
        """An offset of PhysX in metres; 0: the file gives none, or leaves it to the engine."""
        value = prim.GetAttribute(name).Get(self._time) if prim.HasAttribute(name) else None
        return self._unit * float(value) if value is not None and 0.0 < float(value) < np.inf else 0.0

    def _mass(self, prim: Any) -> float | None:
        mass = self._usd.UsdPhysics.MassAPI(prim).GetMassAttr().Get(self._time) or 0.0
        return self._kilograms * float(mass) if 0.0 < mass < np.inf else None

    def _note_changes(self, geometry: _Geometry, name: str) -> None:
        """Name what moves within a body, and meshes that change."""
        own = {*self._times_of(geometry.prim)}
        for prim in dict.fromkeys([*geometry.drawn, *geometry.colliding]):
            if not own >= {*self._times_of(prim)}:
                self.left_out.append(f"the motion of {str(prim.GetPath())!r} within {name!r}")
            scheme = prim.GetAttribute("subdivisionScheme")
            if scheme and scheme.HasAuthoredValue() and scheme.Get(self._time) != "none":
                self.left_out.append(f"the subdivision of {str(prim.GetPath())!r}: its polygons are taken as they are")
            if any(attribute.ValueMightBeTimeVarying() for attribute in self._shape_attributes(prim)):
                self.left_out.append(f"the changing shape of {str(prim.GetPath())!r}")

    def _shape_attributes(self, prim: Any) -> Iterator[Any]:
        names = ("points", "faceVertexIndices", "size", "radius", "radiusTop", "radiusBottom", "height")
        return (prim.GetAttribute(name) for name in names if prim.HasAttribute(name))

    def _times_of(self, prim: Any) -> list[float]:
        """Time codes of the samples that move a prim, its own and of those above."""
        codes = set[float]()
        while prim and not prim.IsPseudoRoot():
            xform = self._usd.UsdGeom.Xformable(prim)
            if xform:
                codes.update(xform.GetTimeSamples())
                if xform.GetResetXformStack():
                    break
            prim = prim.GetParent()
        return sorted(codes)

    def _filtered_pairs(self) -> Iterator[tuple[Any, Any]]:
        """Pairs of bodies of which no two colliders meet; where some do and others do not, that is named."""
        groups = _Groups(self._usd, self._stage)
        filtered = {*self._filtered_colliders()}
        bodies = {
            path: tuple(prim.GetPath() for prim in geometry.colliding) for path, geometry in self._geometry_of.items()
        }
        if not filtered and not groups.members:
            return
        for first, second in combinations(bodies, 2):
            answers = {
                frozenset((a, b)) not in filtered and groups.meet(a, b) for a in bodies[first] for b in bodies[second]
            }
            if answers == {False}:
                yield first, second
            elif len(answers) == 2:
                names = f"{self._names[first]!r} and {self._names[second]!r}"
                self.left_out.append(f"filters that let some colliders of {names} meet and others not: all meet")

    def _filtered_colliders(self) -> Iterator[frozenset[Any]]:
        """Pairs of colliders that FilteredPairsAPI or an articulation without self-collisions keeps apart."""
        usd = self._usd
        for prim in usd.Usd.PrimRange.Stage(self._stage, usd.Usd.TraverseInstanceProxies()):
            if prim.HasAPI(usd.UsdPhysics.FilteredPairsAPI):
                own = self._colliders_below(prim.GetPath())
                for target in usd.UsdPhysics.FilteredPairsAPI(prim).GetFilteredPairsRel().GetForwardedTargets():
                    yield from (frozenset((a, b)) for a in own for b in self._colliders_below(target))
            if prim.HasAttribute(SELF_COLLISIONS) and prim.GetAttribute(SELF_COLLISIONS).Get(self._time) is False:
                yield from map(frozenset, combinations(self._colliders_below(prim.GetPath()), 2))

    def _colliders_below(self, path: Any) -> Sequence[Any]:
        """The collider of a prim, those of a body, or those of all bodies below a prim."""
        if path in self._geometry_of:
            return [prim.GetPath() for prim in self._geometry_of[path].colliding]
        colliders = (prim.GetPath() for geometry in self._geometry_of.values() for prim in geometry.colliding)
        return [collider for collider in colliders if collider.HasPrefix(path)]

    def _jointed_pairs(self, joints: Iterable[Any]) -> Iterator[tuple[Any, Any]]:
        """Pairs of bodies that a joint holds together; they collide only where it says so."""
        for prim in joints:
            joint = self._usd.UsdPhysics.Joint(prim)
            if joint.GetCollisionEnabledAttr().Get(self._time) or not joint.GetJointEnabledAttr().Get(self._time):
                continue
            targets = [joint.GetBody0Rel().GetForwardedTargets(), joint.GetBody1Rel().GetForwardedTargets()]
            ends = [self._owner(self._stage.GetPrimAtPath(target[0])) for target in targets if target]
            paths = [prim.GetPath() for prim in ends if prim]
            if len({*paths}) == 2 and self._geometry_of.keys() >= {*paths}:
                yield paths[0], paths[1]

    def _notes(self, up: str) -> Iterator[str]:
        geometry = self._usd.UsdGeom
        root = self._stage.GetPseudoRoot()
        if not geometry.StageHasAuthoredMetersPerUnit(self._stage):
            yield f"metersPerUnit is not said: {self._unit:g}, as USD defines"
        elif self._unit != 1.0:
            yield f"lengths times {self._unit:g} (metersPerUnit)"
        if not root.HasAuthoredMetadata(geometry.Tokens.upAxis):
            yield f"upAxis is not said: {up}, as USD defines"
        yield from repeated_names([path.name for path in self._names], [*self._names.values()])


class _Groups:
    """The collision groups of a stage: ``members``: collider -> its groups, looked up as they are asked."""

    def __init__(self, usd: Any, stage: Any) -> None:
        group = usd.UsdPhysics.CollisionGroup
        self._table = group.ComputeCollisionGroupTable(stage)
        self.members = [
            (prim.GetPath(), group(prim).GetCollidersCollectionAPI().ComputeMembershipQuery())
            for prim in stage.Traverse()
            if prim.IsA(group)
        ]
        self._of: dict[Any, tuple[Any, ...]] = {}
        self._meet: dict[tuple[Any, Any], bool] = {}

    def meet(self, first: Any, second: Any) -> bool:
        """Whether no two groups of two colliders keep them apart."""
        return all(self._groups_meet(a, b) for a in self._groups_of(first) for b in self._groups_of(second))

    def _groups_of(self, collider: Any) -> tuple[Any, ...]:
        if collider not in self._of:
            self._of[collider] = tuple(path for path, query in self.members if query.IsPathIncluded(collider))
        return self._of[collider]

    def _groups_meet(self, first: Any, second: Any) -> bool:
        if (first, second) not in self._meet:
            self._meet[first, second] = bool(self._table.IsCollisionEnabled(first, second))
        return self._meet[first, second]


def _steps(path: Any) -> tuple[str, ...]:
    return tuple(str(path).strip("/").split("/"))
