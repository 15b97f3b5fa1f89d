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
    near = components_near_each_other(components) if len(components) <= MOST_COMPONENTS else []
    if not near:
        return
    crossing = int(components_that_meet(components, near).sum())
    if crossing:
        yield Finding("mesh-parts-cross", f"{crossing} of {len(near)} pairs of parts cross", name, count=crossing)
    elif mesh.is_closed and components_inside_alike(components, near):
        yield Finding("mesh-parts-nested", "parts lie inside others that are wound alike", name, count=1)
