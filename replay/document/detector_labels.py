"""Labels of detectors."""

from collections.abc import Mapping
from typing import Any, Final

from cdcore.detectors.detector_table import detector_row, settings_of
from replay.detection.recorded import RECORDED_DETECTOR, RECORDED_LABEL
from replay.words import length, plural

SHAPE_LABELS: Final[Mapping[str, str]] = {
    "hull": "convex hulls",
    "shipped": "recorded colliders",
    "box": "boxes",
    "sphere": "spheres",
    "capsule": "capsules",
    "mesh": "triangle meshes",
    "compound": "convex pieces",
}
"""Shape of a collider -> its words."""


def detector_label(name: str, settings: Mapping[str, Any], release: float = 0.0) -> str:
    """Return the label of a detector: ``convex hulls at 50 Hz``; its own name where no table has it.

    ``release``: metres up to which a contact lasts, once it has begun.
    """
    label = _label_without_release(name, settings)
    return f"{label}, off at {length(release)}" if release else label


def _label_without_release(name: str, settings: Mapping[str, Any]) -> str:
    if name == RECORDED_DETECTOR:
        return RECORDED_LABEL
    table_row, rate = detector_row(name), settings.get("rate_hz")
    label = shape_label(settings) if name == "collider" else table_row.label
    if rate:
        return f"{label} at {rate:g} Hz"
    return f"{label}, every frame" if table_row.sampled else label


def shape_label(settings: Mapping[str, Any]) -> str:
    """Return the parts of a collider: ``convex hulls``, ``1 convex piece``, ``16 convex pieces`` a mesh at most."""
    if settings.get("shape") != "compound":
        return SHAPE_LABELS.get(str(settings.get("shape")), "colliders")
    pieces = settings.get("pieces", settings_of("collider", {"shape": "compound"}).pieces)
    return plural(pieces, "convex piece")


def sentence_of(text: str) -> str:
    """Words as the beginning of a sentence; a name of code keeps its letters."""
    return text if ":" in text else text[:1].upper() + text[1:]
