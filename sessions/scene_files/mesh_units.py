"""Units of mesh files: said by their user, defined by their format, or guessed by the size of the mesh.

A size fits several units: a thing of 0.8 units is a bench in metres and a stopper in centimetres. A lone mesh leaves
that open; beside other files whose unit is certain it has theirs, unless that makes it a thing of an unusual size.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Final

from sessions.mesh_data import MeshData
from sessions.meshes.conventions import Convention
from sessions.meshes.mesh_match import FORMAT_UNIT, UNITS, file_size, likely_units, possible_units
from sessions.model.assumption import Assumption, Confidence, Origin, Subject
from sessions.model.scene import SceneBody

SMALLEST_BESIDE_OTHERS_M: Final = 0.001
"""A mesh may have the unit of other files, or of the poses, where that makes it no smaller than this."""


def file_type_of(file: str) -> str:
    """Returns the ending of a file's name in small letters, without the point."""
    return file.rpartition(".")[2].lower()


def mesh_unit(
    file: str, mesh: MeshData, unit: str, poses: Convention, *, stated_by: Origin | None = None
) -> Assumption:
    """Returns the unit of a mesh file: stated, of its format, or by the size of its mesh, which is in metres.

    ``stated_by``: the user or the file; ``None``: nobody.
    """
    origin, reason, alternatives = Origin.GUESS, "by its size", possible_units(mesh, unit)
    if stated_by is not None:
        origin, reason = stated_by, ""
    elif FORMAT_UNIT.get(file_type_of(file)) == unit:
        origin, reason = Origin.FORMAT, ""
    elif unit == poses.unit:
        reason, alternatives = f"by its size, and {poses.name} has this unit", (unit,)
    elif poses.unit and file_size(mesh, unit) * UNITS[poses.unit] >= SMALLEST_BESIDE_OTHERS_M:
        alternatives = tuple(dict.fromkeys((*alternatives, poses.unit)))
    return _unit_assumption(file, unit, origin, reason, alternatives)


def scene_mesh_unit(body: SceneBody, mesh: MeshData) -> Assumption:
    """Returns the unit of a mesh file by the scale that its scene gives it, else metres; ``mesh`` is in metres."""
    unit = next((name for name, metres in UNITS.items() if metres == body.scale), f"{body.scale:g} m")
    origin, reason = Origin.USER, ""
    alternatives: tuple[str, ...] = (unit,)
    if body.scale == 1.0 and FORMAT_UNIT.get(file_type_of(body.mesh)) == unit:
        origin = Origin.FORMAT
    elif body.scale == 1.0:
        origin, reason, alternatives = Origin.GUESS, "the scene gives it no scale", possible_units(mesh, unit)
    return _unit_assumption(Path(body.mesh).name, unit, origin, reason, alternatives)


def _unit_assumption(file: str, unit: str, origin: Origin, reason: str, alternatives: tuple[str, ...]) -> Assumption:
    is_open = origin is Origin.GUESS and len(alternatives) > 1
    return Assumption(
        subject=Subject.MESH_UNIT,
        value=unit,
        origin=origin,
        confidence=Confidence.OPEN if is_open else Confidence.SURE,
        files=(file,),
        reason=reason,
        alternatives=alternatives,
    )


def units_beside_others(units: Mapping[str, Assumption], meshes: Mapping[str, MeshData]) -> Iterator[Assumption]:
    """Yields the unit of each body's mesh (in metres), where it is guessed compared with those of the other bodies.

    Beside a certain mesh of its unit a mesh has another unit only where its size is not much less usual then. A mesh
    that looks like metres may have the smaller unit of others, where it is then no smaller than a millimetre.
    """
    for name, row in units.items():
        if row.origin is not Origin.GUESS:
            yield replace(row, bodies=(name,))
            continue
        others = [other for key, other in units.items() if key != name]
        reason, alternatives = row.reason, row.alternatives
        if any(other.value == row.value for other in others if _is_certain(other)):
            likely = likely_units(meshes[name], row.value)
            alternatives = tuple(unit for unit in alternatives if unit in likely)
        smaller = [other.value for other in others if other.value in UNITS and other.value != "m"]
        if row.value == "m" and smaller:
            unit = max(smaller, key=smaller.count)
            if unit not in alternatives and file_size(meshes[name], "m") * UNITS[unit] >= SMALLEST_BESIDE_OTHERS_M:
                reason = f"by its size; other mesh files are in {unit}"
                alternatives = (*alternatives, unit)
        confidence = Confidence.OPEN if len(alternatives) > 1 else Confidence.SURE
        yield replace(row, bodies=(name,), confidence=confidence, reason=reason, alternatives=alternatives)


def _is_certain(row: Assumption) -> bool:
    """Whether a unit was said, or no other one fits the size of the mesh; the unit of a format is of that alone."""
    return row.origin is Origin.USER or (row.origin is Origin.GUESS and len(row.alternatives) == 1)
