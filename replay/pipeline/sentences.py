"""What a detector is, in words."""

from collections.abc import Mapping
from typing import Any, Final

from cdcore.detectors import settings_of
from replay.base.shown import plural
from replay.detection.recorded import RECORDED

SHAPES: Final[Mapping[str, str]] = {
    "hull": "convex hulls", "shipped": "recorded colliders", "box": "boxes",
    "sphere": "spheres", "capsule": "capsules", "mesh": "triangle meshes",
    "compound": "convex pieces",
}  # fmt: skip
"""Shape of a collider -> its words."""

KINDS: Final[Mapping[str, str]] = {
    "sphere": "bounding spheres", "aabb": "boxes, then triangles", "obb": "turned boxes, then triangles",
    "static": "triangles after a move", "discrete": "triangle meshes", "hybrid": "spheres, boxes, triangles",
    "qaco": "ant colony", "hybrid-qaco": "spheres, boxes, ant colony", "rapid-style": "trees as in RAPID",
    "solid-style": "trees as in SOLID", "image-space": "depth images", "mujoco": "MuJoCo's colliders",
    "rapier": "Rapier's colliders", "bullet": "Bullet's colliders", "physx": "PhysX's colliders",
    "exact": "every triangle, every frame", "continuous": "every triangle, between frames",
    RECORDED: "what the engine reported",
}  # fmt: skip
"""Detector -> what it asks."""


def detector_words(name: str, settings: Mapping[str, Any]) -> str:
    """What a detector is: ``convex hulls at 50 Hz``; of one of no table its own name."""
    words = shape_words(settings) if name == "collider" else KINDS.get(name, name)
    rate = settings.get("rate_hz")
    if rate and name != RECORDED:
        return f"{words} at {rate:g} Hz"
    return f"{words}, every frame" if name in ("collider", "discrete") else words


def shape_words(settings: Mapping[str, Any]) -> str:
    """What a collider is made of: ``convex hulls``, ``1 convex piece``, ``16 convex pieces`` a mesh at most."""
    if settings.get("shape") != "compound":
        return SHAPES.get(str(settings.get("shape")), "colliders")
    pieces = settings.get("pieces", settings_of("collider", {"shape": "compound"}).pieces)
    return plural(pieces, "convex piece")


def sentence_of(what: str) -> str:
    """Words as the beginning of a sentence; a name of code keeps its letters."""
    return what if ":" in what else what[:1].upper() + what[1:]
