"""The collision-detection core: arrays in, arrays out; no files, no logging, no pictures."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cdcore.detectors.detector_table import DETECTORS, create_detector
    from cdcore.impact import Impact, TimeOfImpact, time_of_impact
    from cdcore.mesh import TriangleMesh
    from cdcore.narrow.intersecting_faces import intersecting_faces
    from cdcore.protocol import (
        Body,
        Detection,
        Detector,
        FaceSets,
        FrameDetector,
        Motion,
        Verdict,
        detect_live,
        join,
    )
    from cdcore.triangles.decide import triangles_intersect

__all__ = [
    "DETECTORS",
    "Body",
    "Detection",
    "Detector",
    "FaceSets",
    "FrameDetector",
    "Impact",
    "Motion",
    "TimeOfImpact",
    "TriangleMesh",
    "Verdict",
    "create_detector",
    "detect_live",
    "intersecting_faces",
    "join",
    "time_of_impact",
    "triangles_intersect",
]

_NAMES = {
    "detectors.detector_table": "DETECTORS create_detector",
    "mesh": "TriangleMesh",
    "impact": "Impact TimeOfImpact time_of_impact",
    "narrow.intersecting_faces": "intersecting_faces",
    "triangles.decide": "triangles_intersect",
    "protocol": "Body Detection Detector FaceSets FrameDetector Motion Verdict detect_live join",
}
_HOME = {name: f"cdcore.{module}" for module, names in _NAMES.items() for name in names.split()}
"""Public name -> module; loaded on first use, so that ``import cdcore`` costs nothing."""


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}; it has: {', '.join(__all__)}")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return __all__
