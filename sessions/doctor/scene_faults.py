"""Findings about the scene: what it speaks of that was not recorded, and what was recorded that it cannot use."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from sessions.doctor.finding import Finding, Severity
from sessions.scene import Scene, SceneBody
from sessions.scene_pairs import absent_bodies


def scene_findings(scene: Scene, names: Sequence[str], meshes: Sequence[str]) -> Iterator[Finding]:
    """Everything about declared and recorded bodies.

    Parameters
    ----------
    names : tracked bodies.
    meshes : bodies with a mesh.
    """
    fixed = [body.id for body in scene.bodies if body.fixed is not None]
    there = {*names, *fixed}
    for body in scene.bodies:
        yield from _declared(body, there)
    declared = {body.id for body in scene.bodies}
    for name in absent_bodies(scene, [*there]):
        if name not in declared:
            yield Finding("unrecorded-body", Severity.WARNING, "paired in the scene, but not recorded", name)
    for name in dict.fromkeys([*names, *fixed]):
        if name not in meshes:
            yield Finding("no-mesh", Severity.NOTE, "no mesh: contacts of it cannot be found", name)
    for name in names if declared else ():
        if name not in declared:
            yield Finding("undeclared-body", Severity.NOTE, "recorded, but not declared in the scene", name)


def _declared(body: SceneBody, there: set[str]) -> Iterator[Finding]:
    if body.id not in there:
        message = "declared in the scene, with neither a track nor a fixed pose"
        yield Finding("unrecorded-body", Severity.WARNING, message, body.id)
    if body.parent and body.parent not in there:
        message = f"its parent {body.parent!r} has neither a track nor a fixed pose"
        yield Finding("unrecorded-body", Severity.ERROR, message, body.id)
    if body.proxy:
        yield Finding("proxy", Severity.NOTE, "its mesh only stands in for the real one", body.id)
