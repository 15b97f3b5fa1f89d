"""Findings about a session and its scene, but not about its file: the container code is not loaded."""

from collections.abc import Collection, Iterator, Mapping, Sequence

import numpy as np

from sessions.doctor.finding import Finding, Severity, Span
from sessions.doctor.meshes import all_mesh_findings
from sessions.doctor.pose_pass import PosePass, look_through
from sessions.doctor.pose_spans import pose_findings
from sessions.doctor.scale import scale_findings
from sessions.doctor.timing import time_findings
from sessions.importers.ledger import FACT, ledger_of
from sessions.model.constants import BLOCK_FRAMES
from sessions.model.scene import Scene, SceneBody, absent_bodies
from sessions.model.session import Session
from sessions.model.track import GazeTrack, ScalarTrack


def examine_session(
    session: Session, looked: PosePass | None = None, needed: Collection[str] | None = None
) -> Iterator[Finding]:
    """Everything about a session but its file.

    ``looked``: the pass over its frames, made here when not given; ``needed``: the bodies whose meshes are looked at,
    ``None``: all.
    """
    looked = looked or look_through(session.blocks(BLOCK_FRAMES), session.scene.space_radius)
    scene, meshes = session.scene, session.meshes
    yield from time_findings(looked)
    yield from pose_findings(looked)
    yield from import_findings(session.facts)
    yield from scale_findings(looked, scene, session.facts)
    names = [name for name in meshes if needed is None or name in needed]
    yield from all_mesh_findings(meshes, names)
    yield from scene_findings(scene, looked.names, [*meshes])
    yield from stream_findings(session, looked)


def import_findings(facts: Mapping[str, str]) -> Iterator[Finding]:
    """Large losses of the import that a session comes from, by its ledger."""
    if FACT not in facts:
        return
    ledger = ledger_of(facts)
    if ledger is None:
        yield Finding("import-loss", "its ledger cannot be read, so that what the import dropped is not known")
        return
    for entry in ledger.large_losses():
        yield Finding("import-loss", entry.loss, entry.body, count=entry.lost)


def stream_findings(session: Session, looked: PosePass) -> Iterator[Finding]:
    """Everything about gaze and scalars."""
    zero, last = (int(looked.stamp_ns.min()), int(looked.stamp_ns.max())) if len(looked.stamp_ns) else (0, 0)
    streams: list[tuple[str, GazeTrack | ScalarTrack | None]]
    streams = [(f"gaze {name!r}", gaze) for name, gaze in session.gaze.items()]
    streams += [(f"scalar {name!r}", scalar) for name, scalar in session.scalars.items()]
    for called, one in streams:
        if one is None:  # of a file whose messages cannot be read
            continue
        stamps, there = one.times_ns, one.valid if isinstance(one, GazeTrack) else np.isfinite(one.values)
        if not there.any():
            yield Finding("stream-empty", f"{called}: no sample of {len(one)} holds anything")
        elif zero < last and (stamps[0] > last or stamps[-1] < zero):
            ends = f"{(stamps[0] - zero) / 1e9:.1f} s to {(stamps[-1] - zero) / 1e9:.1f} s after the first pose"
            message = f"{called}: it lasts from {ends}, the poses {(last - zero) / 1e9:.1f} s"
            yield Finding("stream-apart", message)
        if isinstance(one, GazeTrack) and (lost := np.flatnonzero(there & ~one.usable)).size:
            message = f"{called}: samples that are seen and hold no direction: {len(lost)}"
            span = Span(int(stamps[lost[0]]), int(stamps[lost[-1]]), zero)
            yield span.finding("gaze-nowhere", message, count=len(lost))


def scene_findings(scene: Scene, names: Sequence[str], meshes: Sequence[str]) -> Iterator[Finding]:
    """Everything about declared bodies, tracked ones (``names``), and those with a mesh."""
    fixed = [body.id for body in scene.bodies if body.fixed is not None]
    there = {*names, *fixed}
    for body in scene.bodies:
        yield from _declared(body, there)
    declared = {body.id for body in scene.bodies}
    for name in absent_bodies(scene, [*there]):
        if name not in declared:
            yield Finding("unrecorded-body", "paired in the scene, but not recorded", name)
    bare = [name for name in dict.fromkeys([*names, *fixed]) if name not in meshes]
    if bare and len(bare) == len(there):
        yield Finding("no-mesh", "no body has a mesh: a run has nothing to replay", own_severity=Severity.ERROR)
    for name in bare:
        yield Finding("no-mesh", "no mesh: its contacts cannot be computed", name)
    for name in names if declared else ():
        if name not in declared:
            yield Finding("undeclared-body", "recorded, but not declared in the scene", name)


def _declared(body: SceneBody, there: set[str]) -> Iterator[Finding]:
    if body.id not in there:
        message = "declared in the scene, with neither a track nor a fixed pose"
        yield Finding("unrecorded-body", message, body.id)
    if body.parent and body.parent not in there:
        message = f"its parent {body.parent!r} has neither a track nor a fixed pose"
        yield Finding("unrecorded-body", message, body.id, own_severity=Severity.ERROR)
    if body.proxy:
        yield Finding("proxy", "its mesh only stands in for the real one", body.id)
