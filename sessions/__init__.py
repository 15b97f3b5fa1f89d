"""Recorded sessions: their model, their file, where they come from, and whether they can be trusted."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sessions.doctor.examine import examine
    from sessions.doctor.finding import Finding, Severity
    from sessions.geometry.shapes import make_shape
    from sessions.glassware.catalogue import make_instrument
    from sessions.importers import IMPORTERS
    from sessions.importers.importing import import_session
    from sessions.mcap.reader import read_session
    from sessions.mcap.recorder import Recorder
    from sessions.mcap.salvage import recover
    from sessions.mcap.writer import write_session
    from sessions.mesh_data import MeshData
    from sessions.meshes.glb import mesh_to_glb
    from sessions.meshes.mesh_files import load_mesh
    from sessions.model.event import Event, Interval, LiveContact
    from sessions.model.scene import Scene
    from sessions.model.session import Frames, GazeTrack, HandTrack, ScalarTrack, Session, Status, Track
    from sessions.scene_files.scene_toml import parse_scene, read_scene

__all__ = [
    "IMPORTERS",
    "Event",
    "Finding",
    "Frames",
    "GazeTrack",
    "HandTrack",
    "Interval",
    "LiveContact",
    "MeshData",
    "Recorder",
    "ScalarTrack",
    "Scene",
    "Session",
    "Severity",
    "Status",
    "Track",
    "examine",
    "import_session",
    "load_mesh",
    "make_instrument",
    "make_shape",
    "mesh_to_glb",
    "parse_scene",
    "read_scene",
    "read_session",
    "recover",
    "write_session",
]

_NAMES = {
    "doctor.examine": "examine",
    "doctor.finding": "Finding Severity",
    "geometry.shapes": "make_shape",
    "glassware.catalogue": "make_instrument",
    "importers": "IMPORTERS",
    "importers.importing": "import_session",
    "mcap.reader": "read_session",
    "mcap.recorder": "Recorder",
    "mcap.writer": "write_session",
    "mesh_data": "MeshData",
    "meshes.glb": "mesh_to_glb",
    "meshes.mesh_files": "load_mesh",
    "model.event": "Event Interval LiveContact",
    "model.scene": "Scene",
    "model.session": "Frames GazeTrack HandTrack ScalarTrack Session Status Track",
    "mcap.salvage": "recover",
    "scene_files.scene_toml": "parse_scene read_scene",
}
_HOME = {name: f"sessions.{module}" for module, names in _NAMES.items() for name in names.split()}
"""Public name -> module; loaded on first use, so that ``import sessions`` costs nothing."""


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}; it has: {', '.join(__all__)}")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return __all__
