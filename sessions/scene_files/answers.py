"""A recording as it would be, had an assumption of its import been another one; and as it was before anybody answered.

Axes are exchanged by signed permutations, which lose no bit; units scale, which rounds the last one.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sessions.errors import SessionError
from sessions.mesh_data import MeshData
from sessions.meshes.conventions import CONVENTIONS, convention
from sessions.meshes.mesh_axes import mesh_axes_alternatives, mesh_axes_description
from sessions.meshes.mesh_match import UNITS
from sessions.model.assumption import (
    ASSUMPTIONS_FACT,
    Assumption,
    Confidence,
    Origin,
    Subject,
    assumptions_fact,
    assumptions_of,
    pose_convention,
)
from sessions.model.session import Frames, Session, Track
from sessions.scene_files.body_axes import axes_change
from sessions.scene_files.pose_axes import with_pose_axes

OPTIONS: Final = {
    Subject.MESH_AXES: "--mesh-axes",
    Subject.MESH_UNIT: "--mesh-units",
    Subject.LENGTH_UNIT: "units in the mapping",
    Subject.COLLIDER_AXES: "--collider-axes",
    Subject.POSE_AXES: "--convention",
    Subject.ANGLE_UNIT: "angle_unit in the mapping",
    Subject.SURFACE: "--surface",
}
"""Subject -> the option of ``replay import`` that decides it."""

CHANGEABLE: Final = frozenset(
    {Subject.POSE_AXES, Subject.MESH_AXES, Subject.MESH_UNIT, Subject.LENGTH_UNIT, Subject.COLLIDER_AXES}
)
"""Subjects that have another value in a recording without another import."""

_IMPORTED_AXES: Final = re.compile(r"axes (\S+) \(")
"""How the conversions of earlier releases begin that name the convention of the poses."""


def recording_assumptions(session: Session) -> tuple[Assumption, ...]:
    """Returns the assumptions of a recording; those of an import of an earlier release are not known.

    A recording that was never imported is in the canonical frame by its format.
    """
    kept = assumptions_of(session.facts)
    if kept is not None:
        return kept
    conversions = session.facts.get("conversions", "none")
    named = _IMPORTED_AXES.search(conversions)
    if named is None or named[1] not in CONVENTIONS or CONVENTIONS[named[1]].is_canonical:
        return ()
    poses = CONVENTIONS[named[1]]
    axes = Assumption(Subject.POSE_AXES, poses.name, Origin.NOT_KNOWN, description=poses.description)
    # Earlier releases left meshes as their files had them, or turned them as Unity's exporter does.
    was = "x-flipped" if "flips X instead of Z" in conversions else "gltf"
    bodies = tuple(session.meshes)
    if not bodies:
        return (axes,)
    meshes = Assumption(
        subject=Subject.MESH_AXES,
        value=was,
        origin=Origin.NOT_KNOWN,
        confidence=Confidence.OPEN,
        bodies=bodies,
        files=tuple(f"the mesh of {name}" for name in bodies),
        description=mesh_axes_description(was, poses),
        reason="an earlier release imported it and did not keep them",
        alternatives=mesh_axes_alternatives(was, poses),
    )
    return axes, meshes


def known_convention(assumptions: Sequence[Assumption], facts: Mapping[str, str]) -> str:
    """Returns the convention of the poses by these assumptions."""
    named = (row.value for row in assumptions if row.subject is Subject.POSE_AXES)
    return next(named, pose_convention(facts).name)


def with_answer(session: Session, assumption: Assumption, value: str) -> Session:
    """Returns the recording with another value of one of its assumptions, which its user said.

    Raises SessionError: a value that the assumption cannot have, or one that no recording can be changed to.
    """
    return _with_changed_assumption(
        session, assumption, assumption.answered(value, _description(session, assumption, value))
    )


def with_answers_forgotten(session: Session) -> tuple[Session, int]:
    """Returns the recording as it was before its user answered, and how many answers were forgotten."""
    forgotten = 0
    # Axes of poses last: what a mesh was taken for depends on them.
    for row in sorted(recording_assumptions(session), key=lambda row: row.subject is Subject.POSE_AXES):
        if row.guessed_value:
            session = _with_changed_assumption(
                session, row, row.unanswered(_description(session, row, row.guessed_value))
            )
            forgotten += 1
    return session, forgotten


def _description(session: Session, assumption: Assumption, value: str) -> str:
    if assumption.subject in (Subject.MESH_AXES, Subject.COLLIDER_AXES):
        poses = known_convention(recording_assumptions(session), session.facts)
        return mesh_axes_description(value, convention(poses))
    if assumption.subject is Subject.POSE_AXES:
        return convention(value).description
    return ""


def _with_changed_assumption(session: Session, before: Assumption, after: Assumption) -> Session:
    """The recording with one assumption in place of another."""
    rows = recording_assumptions(session)
    if before not in rows:
        raise SessionError(f"the recording holds no assumption on the {before.title}; see `replay info -v`")
    if before.value == after.value:
        changed = session
    elif before.subject is Subject.MESH_AXES:
        changed = replace(session, meshes=_rotated_meshes(session, before, after.value))
    elif before.subject is Subject.COLLIDER_AXES:
        changed = replace(session, colliders=_rotated_colliders(session, before, after.value))
    elif before.subject is Subject.POSE_AXES:
        return _in_usual_unit(with_pose_axes(session, before, after), before.value, after.value)
    elif before.subject is Subject.MESH_UNIT:
        scale = UNITS[after.value] / UNITS[before.value]
        meshes = {name: _scaled_mesh(session.meshes[name], scale) for name in before.bodies}
        changed = replace(session, meshes={**session.meshes, **meshes})
    elif before.subject is Subject.LENGTH_UNIT:
        scaled = _scaled_poses(session, UNITS[after.value] / UNITS[before.value])
        changed = replace(scaled, facts=_facts_of_unit(session.facts, after))
    else:
        option = OPTIONS.get(before.subject, "the mapping")
        raise SessionError(f"the {before.title} cannot be changed in a recording; import it again, with {option}")
    written = assumptions_fact(after if row == before else row for row in rows)
    return replace(changed, facts={**changed.facts, ASSUMPTIONS_FACT: written})


def _in_usual_unit(session: Session, before: str, after: str) -> Session:
    """The recording with its lengths in the unit of a convention, where they were guessed to be in that of another."""
    was, unit = (convention(name).unit or "m" for name in (before, after))
    for row in recording_assumptions(session):
        if row.subject is Subject.LENGTH_UNIT and row.origin is Origin.GUESS and row.value == was != unit:
            others = [other for other in row.alternatives if other != unit]
            return _with_changed_assumption(session, row, replace(row, value=unit, alternatives=(unit, *others)))
    return session


def _facts_of_unit(facts: Mapping[str, str], row: Assumption) -> dict[str, str]:
    """The facts of a recording whose lengths came in a unit; sentences of importers on another one go."""
    unit = row.value
    changed = {**facts, "source_units": unit}
    for key, otherwise in (("conversions", "none"), ("assumed", "")):
        sentences = [text for text in facts.get(key, otherwise).split("; ") if not text.startswith("lengths in ")]
        if key == "conversions" and unit != "m":
            sentences = [*(text for text in sentences if text != "none"), f"lengths in {unit} to m"]
        if key == "assumed" and row.origin is Origin.GUESS:
            sentences = [*filter(None, sentences), f"lengths in {unit}"]
        changed[key] = "; ".join(sentences) or otherwise
    return {key: text for key, text in changed.items() if text}


def _rotation_between(session: Session, before: str, after: str) -> NDArray[np.float64]:
    """The matrix (4, 4) from a mesh by one reading of its file's axes to the mesh by another."""
    poses = convention(known_convention(recording_assumptions(session), session.facts))
    return axes_change(before, poses, after, poses)


def _rotated_colliders(session: Session, before: Assumption, axes: str) -> dict[str, tuple[MeshData, ...]]:
    matrix = _rotation_between(session, before.value, axes)
    rotated = {
        name: tuple(solid.transformed(matrix) for solid in session.colliders[name])
        for name in before.bodies
        if name in session.colliders
    }
    return {**session.colliders, **rotated}


def _rotated_meshes(session: Session, before: Assumption, axes: str) -> dict[str, MeshData]:
    """All meshes, those of the assumption turned from the axes they were taken to have."""
    matrix = _rotation_between(session, before.value, axes)
    rotated = {name: session.meshes[name].transformed(matrix) for name in before.bodies if name in session.meshes}
    return {**session.meshes, **rotated}


def _scaled_mesh(mesh: MeshData, scale: float) -> MeshData:
    return MeshData(mesh.vertices * scale, mesh.faces)


def _scaled_poses(session: Session, scale: float) -> Session:
    frames = session.frames
    scaled = Frames(
        frames.names,
        frames.stamp_ns,
        frames.log_ns,
        frames.sample_ns,
        frames.position * scale,
        frames.quaternion_xyzw,
        frames.status,
    )
    fast = {
        name: Track(track.times_ns, track.positions * scale, track.quaternions_xyzw, track.valid)
        for name, track in session.fast_tracks.items()
    }
    return replace(session, source=scaled, fast_tracks=fast)
