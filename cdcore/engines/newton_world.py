"""Newton's list of contacts. The only module that imports ``newton`` and ``warp``.

Newton is written in the kernels of Warp, which compiles them once per machine (17 s to three minutes, 2026-11) and
keeps them in a folder.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any, Final

import numpy as np

from cdcore.bounding.hull import hull_of
from cdcore.engines.engine_solids import EngineSolid, spread_positions
from cdcore.engines.refusals import mesh_may_be_refused, needs_engine, quiet
from cdcore.errors import InvalidMeshError, MissingEngineError
from cdcore.kernels.compiling import engine_compiles
from cdcore.numerics import BoolArray, FloatArray, IntArray

CONTACTS_PER_PAIR: Final = 32
"""Room in the list of contacts at first; two hulls give up to 6."""

LEAST_ROOM: Final = 4096
"""Contacts."""

TRIANGLE_PAIRS: Final = 2**20
"""Room at first for pairs of a hull and a triangle of a mesh; Newton's own least room is 1,000,000."""

LARGEST_ROOM: Final = 2**25
"""Contacts, or pairs of a hull and a triangle: some gigabytes."""


class NewtonWorld:
    """Bodies of Newton without mass on the processor, put at poses by hand, and the pairs (P, 2) that are tested.

    Newton drops contacts for which its buffers have no room. Its counters say so: then the buffers grow and the same
    poses are asked again.

    InvalidMeshError where Newton has no collider for a mesh.
    """

    def __init__(self, solids: list[EngineSolid], pairs: IntArray, settings: Any) -> None:
        with needs_engine("newton", "newton"):
            import newton
            import warp
        self._engine, self._warp = newton, warp
        self._pairs = pairs.astype(np.int32)
        self.contact_room = max(LEAST_ROOM, CONTACTS_PER_PAIR * len(pairs))
        self.triangle_room = TRIANGLE_PAIRS
        with reporting_compilation(warp), mesh_may_be_refused("Newton", ValueError):
            builder = newton.ModelBuilder(gravity=(0.0, 0.0, 0.0))
            config = newton.ModelBuilder.ShapeConfig(gap=settings.gap_m, margin=0.0, density=0.0)
            for solid in solids:
                _add(newton, builder, solid, config)
            self._model = builder.finalize(device="cpu")
            self._state = self._model.state()
            self._allocate()
            # Here every kernel is compiled or loaded, so that no frame pays for it.
            self.touching(*spread_positions(solids), np.ones(len(solids), dtype=np.bool_))

    def touching(self, translations: FloatArray, rotations: FloatArray, valid: BoolArray) -> IntArray:
        """Pairs of bodies for which Newton lists a point of contact; see ``EngineWorld.touching``."""
        if not len(self._pairs):
            return np.zeros((0, 2), dtype=np.int64)
        poses = np.concatenate([translations, rotations], axis=1).astype(np.float32)
        self._state.body_q.assign(poses)
        self._pipeline.collide(self._state, self._contacts)
        while self._has_overflowed():
            self._allocate()
            self._pipeline.collide(self._state, self._contacts)
        count = _count(self._contacts.rigid_contact_count)
        shapes = (self._contacts.rigid_contact_shape0, self._contacts.rigid_contact_shape1)
        rows = np.column_stack([shape.numpy()[:count] for shape in shapes]).astype(np.int64)
        return rows[valid[rows].all(axis=1)]

    def _allocate(self) -> None:
        self._pipeline = self._engine.CollisionPipeline(
            self._model,
            broad_phase="explicit",
            shape_pairs_filtered=self._warp.array(self._pairs, dtype=self._warp.vec2i, device="cpu"),
            rigid_contact_max=self.contact_room,
            max_triangle_pairs=self.triangle_room,
            verify_buffers=False,  # it prints, which nobody reads; ``_has_overflowed`` compares the same counters
        )
        self._contacts = self._pipeline.contacts()

    def _has_overflowed(self) -> bool:
        """Whether a buffer was too small for the contacts of the last poses; then more room is noted for the next."""
        narrow = self._pipeline.narrow_phase
        contacts = _count(self._contacts.rigid_contact_count)
        triangles = _count(narrow.triangle_pairs_count)
        reducer = narrow.global_contact_reducer
        dropped = reducer is not None and _count(reducer.ht_insert_failures) + _count(reducer.buffer_overflows) > 0
        # A full list is too small as well: Newton does not count the contacts of hulls that it drops.
        contacts_fit = contacts < self.contact_room
        triangles_fit = triangles <= self.triangle_room and not dropped
        if not contacts_fit:
            self.contact_room = max(2 * self.contact_room, contacts)
        if not triangles_fit:
            self.triangle_room = max(2 * self.triangle_room, triangles)
        if max(self.contact_room, self.triangle_room) > LARGEST_ROOM:
            raise InvalidMeshError(
                f"Newton has no room for the contacts of these meshes, more than {LARGEST_ROOM:,} in one frame; "
                "give it simpler meshes, or hulls"
            )
        return not (contacts_fit and triangles_fit)


def _count(counter: Any) -> int:
    return 0 if counter is None else int(counter.numpy()[0])


def _add(engine: Any, builder: Any, solid: EngineSolid, config: Any) -> None:
    if solid.faces is None:
        hull = hull_of(solid.corners)
        if hull is None:
            raise InvalidMeshError(f"Newton takes no flat mesh, which {solid.name} is; give it some thickness")
        corners, faces, add = hull.vertices, hull.faces, builder.add_shape_convex_hull
    else:
        corners, faces, add = solid.corners, solid.faces, builder.add_shape_mesh
    mesh = engine.Mesh(corners.astype(np.float32), faces.astype(np.int32).ravel(), compute_inertia=False)
    add(builder.add_body(), mesh=mesh, cfg=config)


@contextmanager
def reporting_compilation(warp: Any) -> Iterator[None]:
    """Warp logs nothing in this context; each kernel that it compiles is reported to ``compiling_reported``.

    MissingEngineError where it can write its kernels nowhere.
    """
    before = warp.config.log_level
    warp.config.log_level = warp.LOG_ERROR
    try:
        with quiet():  # it prints once a process that there is no graphics card
            warp.init()
        with ExitStack() as stack:
            stack.enter_context(_compiler_watched(warp))
            yield
    except PermissionError as error:
        text = "newton can keep its kernels nowhere; set WARP_CACHE_PATH to a folder that can be written"
        raise MissingEngineError(text) from error
    finally:
        warp.config.log_level = before


@contextmanager
def _compiler_watched(warp: Any) -> Iterator[None]:
    """Replaces Warp's compiler by one that reports its work: Warp itself tells of a kernel when it is compiled."""
    build = warp._src.build
    compiler = build.build_cpu

    def compiler_reported(*arguments: Any, **options: Any) -> Any:
        with engine_compiles("Newton", str(warp.config.kernel_cache_dir)):
            return compiler(*arguments, **options)

    build.build_cpu = compiler_reported
    try:
        yield
    finally:
        build.build_cpu = compiler
