"""The collision-detection core: arrays in, arrays out; no files, no logging, no pictures."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cdcore.detectors import DETECTORS, create_detector
    from cdcore.mesh import TriangleMesh
    from cdcore.narrow.continuous.time_of_impact import Impact, TimeOfImpact, time_of_impact
    from cdcore.narrow.intersecting_faces import intersecting_faces
    from cdcore.narrow.triangles.predicates import triangles_intersect
    from cdcore.protocol import Body, Detection, Detector, FaceSets, FrameDetector, Motion, Verdict, join

__all__ = [
    "DETECTORS", "Body", "Detection", "Detector", "FaceSets", "FrameDetector", "Impact", "Motion", "TimeOfImpact",
    "TriangleMesh", "Verdict", "create_detector", "intersecting_faces", "join", "time_of_impact", "triangles_intersect",
]  # fmt: skip

_HOME = {
    "DETECTORS": "cdcore.detectors",
    "Body": "cdcore.protocol",
    "Detection": "cdcore.protocol",
    "Detector": "cdcore.protocol",
    "FaceSets": "cdcore.protocol",
    "FrameDetector": "cdcore.protocol",
    "Impact": "cdcore.narrow.continuous.time_of_impact",
    "Motion": "cdcore.protocol",
    "TimeOfImpact": "cdcore.narrow.continuous.time_of_impact",
    "TriangleMesh": "cdcore.mesh",
    "Verdict": "cdcore.protocol",
    "create_detector": "cdcore.detectors",
    "intersecting_faces": "cdcore.narrow.intersecting_faces",
    "join": "cdcore.protocol",
    "time_of_impact": "cdcore.narrow.continuous.time_of_impact",
    "triangles_intersect": "cdcore.narrow.triangles.predicates",
}
"""Public name -> module; loaded on first use, so that ``import cdcore`` costs nothing."""


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}; it has: {', '.join(__all__)}")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return __all__
