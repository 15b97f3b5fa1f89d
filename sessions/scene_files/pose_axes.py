"""A recording with its poses in other axes of their source, as an import with ``--convention`` makes it.

Meshes in the axes of their bodies turn with their poses; what a file was guessed to have is guessed again. Axes are
exchanged by signed permutations, which lose no bit.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sessions.meshes.conventions import Convention, convention
from sessions.meshes.mesh_axes import mesh_axes_alternatives, mesh_axes_description
from sessions.model.assumption import ASSUMPTIONS_FACT, Assumption, Origin, Subject, assumptions_fact, assumptions_of
from sessions.model.session import Frames, Session, Track
from sessions.scene_files.body_axes import axes_assumption, axes_change

AXES_SENTENCE = "axes "
"""The beginning of a sentence of an importer on the axes of its poses."""


def with_pose_axes(session: Session, before: Assumption, after: Assumption) -> Session:
    """Returns the recording with another convention of its poses; the facts say so."""
    old, new = convention(before.value), convention(after.value)
    meshes, colliders = dict(session.meshes), dict(session.colliders)
    rows = list[Assumption]()
    for row in assumptions_of(session.facts) or ():
        if row == before:
            rows.append(after)
            continue
        if row.subject is Subject.HANDEDNESS:
            rows.append(replace(row, value=new.handedness))
            continue
        if row.subject is Subject.MESH_AXES:
            changed = _mesh_axes(row, new)
            matrix = axes_change(row.value, old, changed.value, new)
            meshes |= {name: meshes[name].transformed(matrix) for name in row.bodies if name in meshes}
        elif row.subject is Subject.COLLIDER_AXES:
            changed = replace(
                row,
                description=mesh_axes_description(row.value, new),
                alternatives=mesh_axes_alternatives(row.value, new),
            )
            matrix = axes_change(row.value, old, row.value, new)
            colliders |= {
                name: tuple(solid.transformed(matrix) for solid in colliders[name])
                for name in row.bodies
                if name in colliders
            }
        else:
            changed = row
        rows.append(changed)
    facts = {**_facts(session.facts, after, new), ASSUMPTIONS_FACT: assumptions_fact(rows)}
    moved = replace(session, meshes=meshes, colliders=colliders, facts=facts)
    return replace(
        moved, source=_frames_in_axes(session.frames, old, new), fast_tracks=_moved_tracks(session, old, new)
    )


def follows_its_poses(before: Session, after: Session) -> bool:
    """Returns whether all meshes turned as their poses did: nothing is then nearer to or farther from another."""
    matrix = pose_axes_change(before, after)
    return all(
        np.array_equal(after.meshes[name].vertices, mesh.vertices @ matrix.T) for name, mesh in before.meshes.items()
    )


def pose_axes_change(before: Session, after: Session) -> NDArray[np.float64]:
    """Returns the matrix (3, 3) from canonical points of a recording to those of one with other axes of its poses."""
    return _pose_axes(after).matrix @ _pose_axes(before).matrix.T


def _pose_axes(session: Session) -> Convention:
    rows = assumptions_of(session.facts) or ()
    return convention(next(row.value for row in rows if row.subject is Subject.POSE_AXES))


def _mesh_axes(row: Assumption, poses: Convention) -> Assumption:
    """The axes of mesh files beside poses of another convention: as their user said, else guessed anew."""
    stated = row.value if row.origin is Origin.USER else ""
    again = axes_assumption(row.bodies[0], row.files[0], stated, poses)
    return replace(
        again, bodies=row.bodies, files=row.files, guessed_value=row.guessed_value, guessed_origin=row.guessed_origin
    )


def _frames_in_axes(frames: Frames, old: Convention, new: Convention) -> Frames:
    return Frames(
        frames.names,
        frames.stamp_ns,
        frames.log_ns,
        frames.sample_ns,
        new.points(old.source_points(frames.position)),
        new.quaternions(old.source_quaternions(frames.quaternion_xyzw)),
        frames.status,
    )


def _moved_tracks(session: Session, old: Convention, new: Convention) -> dict[str, Track]:
    return {
        name: Track(
            track.times_ns,
            new.points(old.source_points(track.positions)),
            new.quaternions(old.source_quaternions(track.quaternions_xyzw)),
            track.valid,
        )
        for name, track in session.fast_tracks.items()
    }


def _facts(facts: Mapping[str, str], row: Assumption, axes: Convention) -> dict[str, str]:
    """The facts of a recording whose poses came in these axes; sentences of importers on others go."""
    changed = {**facts, "source_convention": axes.name, "handedness": axes.handedness}
    named = f"{axes.name} ({axes.description})"
    done = [] if axes.is_canonical else [f"{AXES_SENTENCE}{named} to right-handed, +Y up, -Z forward"]
    guessed = [f"{AXES_SENTENCE}{named}"] if row.origin is Origin.GUESS else []
    for key, first, otherwise in (("conversions", done, "none"), ("assumed", guessed, "")):
        kept = [text for text in facts.get(key, "").split("; ") if text and not text.startswith(AXES_SENTENCE)]
        sentences = [*first, *(text for text in kept if text != "none")]
        changed[key] = "; ".join(sentences) or otherwise
    return {key: text for key, text in changed.items() if text}
