"""The catalogue of sentences: what a detector is, and why it missed a contact or reported a false one.

Each sentence can be checked by looking at the recording, at the moment that it names.
"""

from collections.abc import Mapping
from typing import Any, Final

from numpy import isnan

from cdcore.detectors import settings_of
from replay.base.shown import plural
from replay.base.tables import data_of
from replay.comparison.causes import Cause
from replay.comparison.false_contacts import HELD, HOLLOW, SOLIDS, VOLUMES, FalseContact
from replay.comparison.misses import FOUND_LATE, LOST_EARLY, NEVER_FOUND
from replay.comparison.outcome import Episode, Miss
from replay.detection.recorded import RECORDED

SHAPES: Final[Mapping[str, str]] = {
    "hull": "convex hulls", "shipped": "recorded colliders", "box": "boxes",
    "sphere": "spheres", "capsule": "capsules", "mesh": "triangle meshes",
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


OFFSETS: Final[Mapping[str, tuple[str, float]]] = {
    "collider": ("skin_m", 2.0), "mujoco": ("margin_m", 1.0), "rapier": ("prediction_m", 1.0),
    "bullet": ("margin_m", 2.0), "physx": ("contact_offset_m", 2.0),
}  # fmt: skip
"""Detector -> its setting of a contact offset, and how many of them lie between two bodies."""


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


def duration_words(frames: int, seconds: float) -> str:
    """``1 recorded frame (11 ms)``."""
    return f"{plural(frames, 'recorded frame')} ({1e3 * seconds:.0f} ms)"


def why_missed(miss: Miss, label: str, figures: Mapping[str, Any], contact: Episode) -> str:
    """Why a contact was missed, late or cut short, in a sentence; ``figures`` are the detector's in the summary."""
    pair, when = f"{miss.body_a} and {miss.body_b}", f"at {miss.seconds:.1f} s"
    long = duration_words(miss.frames, miss.end - miss.start)
    became = {
        NEVER_FOUND: f"{label} never reported the contact of {pair} {when}",
        FOUND_LATE: f"{label} reported the contact of {pair} {when} {long} late",
        LOST_EARLY: f"{label} stopped reporting the contact of {pair} {long} too early",
    }.get(miss.kind, f"{label} reported no contact of {pair} for {long} {when}")
    rate = figures["settings"].get("rate_hz")
    if miss.cause == Cause.BETWEEN_LOOKS and rate:
        step = f"{label} samples every {1e3 / rate:.3g} ms"
        lasted = f"the contact of {pair} {when} lasted {1e3 * (contact.end - contact.start):.0f} ms"
        if miss.kind == NEVER_FOUND:
            return f"{step}; {lasted}, between two samples."
        if miss.kind == FOUND_LATE:
            return f"{step}: it reported the contact of {pair} {when} {long} late."
    reason = REASONS["misses"].get(miss.cause, "")
    return f"{became}: {reason}." if reason else f"{became}; nothing known about it explains this."


REASONS: Final = data_of("pipeline/reasons.toml")
"""Of ``misses`` and of ``false`` contacts: cause -> why, as the end of a sentence."""


def why_false(false: FalseContact, label: str, figures: Mapping[str, Any], seconds: float) -> str:
    """Why a false contact was reported, in a sentence about ``seconds``, the moment at which its gap was measured."""
    pair, when = f"{false.body_a} and {false.body_b}", f"at {seconds:.1f} s"
    apart = "" if isnan(false.gap) else f"{length_words(false.gap)} from the surface "
    if false.cause == HOLLOW:
        other = false.body_b if false.hollow == false.body_a else false.body_a
        return f"The convex hull of {false.hollow} fills its hollow: {other} is in the hull, {apart}{when}."
    gap = "the surfaces do not" if isnan(false.gap) else f"the surfaces are {length_words(false.gap)} apart"
    reach = contact_reach(figures)
    if false.cause == SOLIDS and false.gap <= reach:
        near = f"{pair} are {length_words(false.gap)} apart {when}"
        return f"{near}; {label} reports contact from {length_words(reach)} on: its contact offset."
    if false.cause == SOLIDS:
        shape = shape_words(figures["settings"])
        return f"The {shape} of {pair} meet; {gap} {when}."
    if false.cause == VOLUMES:
        return f"Only the bounding volumes of {pair} overlap {when}; {gap}, and {label} tests no triangle."
    long = duration_words(false.frames, false.end - false.start)
    if false.cause == HELD:
        return f"{label} keeps its answer until its next sample: it said contact of {pair} for {long} {when}, too long."
    reason = REASONS["false"].get(false.cause, "")
    said = f"{label} said contact of {pair} {when} for {long}; {gap}"
    return f"{said}: {reason}." if reason else f"{said}. Nothing known about it explains this."


def contact_reach(figures: Mapping[str, Any]) -> float:
    """Metres between two surfaces from which a detector already reports contact, by its ``name`` and ``settings``."""
    setting, times = OFFSETS.get(figures["name"], ("", 0.0))
    return times * float(figures["settings"].get(setting) or 0.0)


def length_words(metres: float) -> str:
    """Millimetres, with a decimal below ten: ``18 mm``, ``0.7 mm``."""
    length = 1e3 * metres
    return f"{length:.0f} mm" if length >= 9.95 else f"{length:.1f} mm"
