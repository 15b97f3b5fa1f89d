"""Everything about a session in memory or in a file, but nothing about the file: no container is loaded for it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from sessions.doctor.finding import Finding
from sessions.doctor.meshes import all_mesh_findings
from sessions.doctor.pose_pass import Looked, look_through
from sessions.doctor.poses import pose_findings
from sessions.doctor.scale import scale_findings
from sessions.doctor.scene_faults import scene_findings
from sessions.doctor.timing import time_findings
from sessions.scene import Scene
from sessions.session import Session

BLOCK_FRAMES: Final = 16384


def examine_session(session: Session, looked: Looked | None = None) -> Iterator[Finding]:
    """Everything about a session but its file; ``looked`` is the pass over its frames, made here when not given."""
    looked = looked or look_through(session.blocks(BLOCK_FRAMES))
    yield from frame_findings(looked, session.scene, dict(session.facts))
    yield from all_mesh_findings(session.meshes)
    yield from scene_findings(session.scene, session.names, [*session.meshes])


def frame_findings(looked: Looked, scene: Scene, facts: dict[str, str]) -> Iterator[Finding]:
    """Everything that the frames tell."""
    yield from time_findings(looked)
    yield from pose_findings(looked)
    yield from scale_findings(looked, scene, facts)
