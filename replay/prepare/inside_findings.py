"""Findings on why it may be undecided what is inside a mesh: parts that cross, or lie in each other wound alike.

Holes and doubled faces are findings of ``sessions.doctor.meshes``; these two need the collision core.
"""

from collections.abc import Iterator, Mapping

from cdcore import TriangleMesh
from cdcore.containment.closed_parts import (
    components_inside_alike,
    components_near_each_other,
    components_that_meet,
    connected_components,
)
from cdcore.errors import CollisionCoreError
from sessions import Finding, MeshData
from sessions.errors import SessionError

MOST_COMPONENTS = 300
"""Parts of a mesh that are compared: the time grows with their square."""


def inside_findings(meshes: Mapping[str, MeshData]) -> Iterator[Finding]:
    """Findings of every mesh; none of one that cannot be loaded, which is a finding elsewhere."""
    for name in meshes:
        try:
            mesh = meshes[name]
            surface = TriangleMesh(mesh.vertices, mesh.faces)
        except (SessionError, CollisionCoreError):
            continue
        yield from containment_findings(name, surface)


def containment_findings(name: str, mesh: TriangleMesh) -> Iterator[Finding]:
    """Findings of one mesh; ``count`` is in pairs of parts."""
    components = connected_components(mesh)
    near_components = components_near_each_other(components) if len(components) <= MOST_COMPONENTS else []
    if not near_components:
        return
    crossing_count = int(components_that_meet(components, near_components).sum())
    if crossing_count:
        yield Finding(
            "mesh-parts-cross",
            f"{crossing_count} of {len(near_components)} pairs of parts cross",
            name,
            count=crossing_count,
        )
    elif mesh.is_closed and components_inside_alike(components, near_components):
        yield Finding("mesh-parts-nested", "parts lie inside others that are wound alike", name, count=1)
