"""Recorded sessions: their model, their file, where they come from, and whether they can be trusted."""

from __future__ import annotations

from importlib import import_module
from typing import Any

_HOME = {
    "Event": "sessions.event",
    "Finding": "sessions.doctor.finding",
    "Frames": "sessions.frames",
    "IMPORTERS": "sessions.importers",
    "HandTrack": "sessions.hand",
    "Interval": "sessions.event",
    "LiveContact": "sessions.live_contact",
    "MeshData": "sessions.mesh_data",
    "Recorder": "sessions.mcap_format.recorder",
    "Scene": "sessions.scene",
    "Session": "sessions.session",
    "Severity": "sessions.doctor.finding",
    "Status": "sessions.frames",
    "Track": "sessions.track",
    "examine": "sessions.doctor.examine",
    "import_session": "sessions.importers",
    "parse_scene": "sessions.scene_toml",
    "recover": "sessions.recovery.recover",
    "read_scene": "sessions.scene_toml",
    "read_session": "sessions.mcap_format.reader",
    "write_session": "sessions.mcap_format.writer",
}
"""Public name -> module; loaded on first use, so that ``import sessions`` costs nothing."""

__all__ = list(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'sessions' has no attribute {name!r}; it has: {', '.join(__all__)}")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return __all__
