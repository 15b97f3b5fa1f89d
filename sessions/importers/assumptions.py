"""Assumptions of a source as data: axes, units, clock and rotations of its poses, axes of its colliders."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

from sessions.importers.given_meshes import MeshOptions
from sessions.meshes.conventions import Convention, pose_axes_alternatives
from sessions.meshes.mesh_axes import mesh_axes_alternatives, mesh_axes_description
from sessions.model.assumption import (
    ASSUMPTIONS_FACT,
    Assumption,
    Confidence,
    Origin,
    Subject,
    assumptions_fact,
    assumptions_of,
)
from sessions.model.session import Session
from sessions.quantities import length
from sessions.scene_files.scene_meshes import COLLIDER_AXES

if TYPE_CHECKING:
    from sessions.importers.pose_table import SourceFrame

SMALLEST_RADIUS_M, LARGEST_RADIUS_M = 0.02, 30.0
"""Metres from the origin within which the poses of a tracked room are; beyond these a guessed unit is open."""

LENGTH_UNITS: Final = ("m", "cm", "mm")


def pose_assumptions(frame: "SourceFrame", radius: float) -> tuple[Assumption, ...]:
    """Returns what was assumed of the poses of a source.

    ``radius``: metres from the origin within which nearly all positions are, as the unit was taken.
    """
    is_guess = frame.axes_origin is Origin.GUESS
    axes = Assumption(
        subject=Subject.POSE_AXES,
        value=frame.axes.name,
        origin=frame.axes_origin,
        confidence=frame.axes_confidence,
        description=_description(frame.axes),
        reason=frame.axes_reason if is_guess else "",
        alternatives=pose_axes_alternatives(frame.axes) if is_guess else (),
    )
    handed_origin, reason = frame.axes_origin, ""
    if frame.axes.assumed_handedness:
        handed_origin, reason = Origin.GUESS, "the axes as text leave it out"
    handedness = Assumption(Subject.HANDEDNESS, frame.axes.handedness, handed_origin, reason=reason)
    clock = Assumption(Subject.CLOCK, frame.clock, frame.clock_origin)
    return axes, handedness, length_unit(frame, radius), clock, *frame.others


def _description(axes: Convention) -> str:
    return "" if axes.description == axes.name else axes.description


def length_unit(frame: "SourceFrame", radius: float) -> Assumption:
    """Returns the unit of lengths; a guess is open where a room of that size would be no laboratory."""
    confidence, reason = Confidence.SURE, ""
    if frame.units_origin is Origin.GUESS and frame.units_reason:
        reason = frame.units_reason
    elif frame.units_origin is Origin.GUESS:
        reason = f"99 of 100 poses are then within {length(radius)} of the origin"
        if not SMALLEST_RADIUS_M <= radius <= LARGEST_RADIUS_M:
            confidence = Confidence.OPEN
    others = [unit for unit in LENGTH_UNITS if unit != frame.units]
    return Assumption(
        subject=Subject.LENGTH_UNIT,
        value=frame.units,
        origin=frame.units_origin,
        confidence=confidence,
        reason=reason,
        alternatives=(frame.units, *others),
    )


def collider_assumptions(session: Session, given: MeshOptions, poses: Convention) -> list[Assumption]:
    """Returns the axes that the file of colliders was taken to have, if there is one."""
    file = str(given.colliders or session.scene.colliders)
    if not file or not session.colliders:
        return []
    axes = given.collider_axes or COLLIDER_AXES
    alternatives = mesh_axes_alternatives(axes, poses)
    is_open = not given.collider_axes and len(alternatives) > 1
    return [
        Assumption(
            subject=Subject.COLLIDER_AXES,
            value=axes,
            origin=Origin.USER if given.collider_axes else Origin.GUESS,
            confidence=Confidence.OPEN if is_open else Confidence.SURE,
            bodies=tuple(session.colliders),
            files=(Path(file).name,),
            description=mesh_axes_description(axes, poses),
            reason="" if given.collider_axes else "the project's own script writes them so",
            alternatives=alternatives,
        )
    ]


def with_assumptions(session: Session, assumptions: Iterable[Assumption]) -> Session:
    """Returns the session with these assumptions beside those that it keeps; a source of none is canonical."""
    kept = assumptions_of(session.facts) or ()
    return replace(session, facts={**session.facts, ASSUMPTIONS_FACT: assumptions_fact([*kept, *assumptions])})
