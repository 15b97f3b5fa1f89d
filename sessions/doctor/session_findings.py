"""Findings about a session and its scene, but not about its file: the container code is not loaded."""

from collections.abc import Collection, Iterator, Mapping, Sequence

import numpy as np

from sessions.doctor.finding import Finding, Severity, Span
from sessions.doctor.meshes import all_mesh_findings
from sessions.doctor.pose_pass import PosePass, run_pose_pass
from sessions.doctor.pose_spans import pose_findings
from sessions.doctor.rotation_evidence import rotation_findings
from sessions.doctor.scale import pivot_findings, scale_findings
from sessions.doctor.timing import time_findings
from sessions.importers.ledger import FACT, ledger_of
from sessions.model.constants import BLOCK_FRAMES
from sessions.model.scene import Scene, SceneBody, absent_bodies
from sessions.model.session import GazeTrack, ScalarTrack, Session


def examine_session(
    session: Session, pose_pass: PosePass | None = None, needed: Collection[str] | None = None
) -> Iterator[Finding]:
    """Everything about a session but its file.

    ``pose_pass``: the pass over its frames, made here when not given; ``needed``: the bodies whose meshes are
    examined, ``None``: all.
    """
    pose_pass = pose_pass or run_pose_pass(session.blocks(BLOCK_FRAMES), session.scene.space_radius)
    scene, meshes = session.scene, session.meshes
    yield from time_findings(pose_pass)
    yield from pose_findings(pose_pass)
    yield from import_findings(session.facts)
    yield from scale_findings(pose_pass, scene, session.facts)
    yield from rotation_findings(pose_pass, scene)
    names = [name for name in meshes if needed is None or name in needed]
    yield from all_mesh_findings(meshes, names)
    children = {body.id for body in scene.bodies if body.parent}
    yield from pivot_findings(pose_pass, meshes, [name for name in names if name not in children])
    yield from scene_findings(scene, pose_pass.names, [*meshes])
    yield from stream_findings(session, pose_pass)


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


def stream_findings(session: Session, pose_pass: PosePass) -> Iterator[Finding]:
    """Everything about gaze and scalars."""
    zero, last = (int(pose_pass.stamp_ns.min()), int(pose_pass.stamp_ns.max())) if len(pose_pass.stamp_ns) else (0, 0)
    streams: list[tuple[str, GazeTrack | ScalarTrack | None]]
    streams = [(f"gaze {name!r}", gaze) for name, gaze in session.gaze.items()]
    streams += [(f"scalar {name!r}", scalar) for name, scalar in session.scalars.items()]
    for called, track in streams:
        if track is None:  # of a file whose messages cannot be read
            continue
        stamps, present = track.times_ns, track.valid if isinstance(track, GazeTrack) else np.isfinite(track.values)
        if not present.any():
            yield Finding("stream-empty", f"{called}: no sample of {len(track)} holds anything")
        elif zero < last and (stamps[0] > last or stamps[-1] < zero):
            ends = f"{(stamps[0] - zero) / 1e9:.1f} s to {(stamps[-1] - zero) / 1e9:.1f} s after the first pose"
            message = f"{called}: it lasts from {ends}, the poses {(last - zero) / 1e9:.1f} s"
            yield Finding("stream-apart", message)
        if isinstance(track, GazeTrack) and (lost := np.flatnonzero(present & ~track.usable)).size:
            message = f"{called}: samples that are seen and hold no direction: {len(lost)}"
            span = Span(int(stamps[lost[0]]), int(stamps[lost[-1]]), zero)
            yield span.finding("gaze-nowhere", message, count=len(lost))


def scene_findings(scene: Scene, names: Sequence[str], meshes: Sequence[str]) -> Iterator[Finding]:
    """Everything about declared bodies, tracked ones (``names``), and those with a mesh."""
    fixed = [body.id for body in scene.bodies if body.fixed is not None]
    present = {*names, *fixed}
    for body in scene.bodies:
        yield from _findings_of_declaration(body, present)
    declared = {body.id for body in scene.bodies}
    for name in absent_bodies(scene, [*present]):
        if name not in declared:
            yield Finding("unrecorded-body", "paired in the scene, but not recorded", name)
    bare = [name for name in dict.fromkeys([*names, *fixed]) if name not in meshes]
    if bare and len(bare) == len(present):
        yield Finding("no-mesh", "no body has a mesh: a run has nothing to replay", own_severity=Severity.ERROR)
    for name in bare:
        yield Finding("no-mesh", "no mesh: its contacts cannot be computed", name)
    for name in names if declared else ():
        if name not in declared:
            yield Finding("undeclared-body", "recorded, but not declared in the scene", name)


def _findings_of_declaration(body: SceneBody, present: set[str]) -> Iterator[Finding]:
    if body.id not in present:
        message = "declared in the scene, with neither a track nor a fixed pose"
        yield Finding("unrecorded-body", message, body.id)
    if body.parent and body.parent not in present:
        message = f"its parent {body.parent!r} has neither a track nor a fixed pose"
        yield Finding("unrecorded-body", message, body.id, own_severity=Severity.ERROR)
    if body.proxy:
        yield Finding("proxy", "its mesh only stands in for the real one", body.id)
