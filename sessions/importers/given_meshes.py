"""Meshes that come beside a recording: read from their files, in metres, in the axes of their bodies.

What a file does not say, its axes and its unit, is assumed; every assumption is kept with who says it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Final

from sessions.errors import ImportFileError, SessionError
from sessions.mesh_data import MeshData
from sessions.meshes.conventions import Convention
from sessions.meshes.mesh_axes import (
    mesh_axes_matrix,
)
from sessions.meshes.mesh_match import FORMAT_UNIT, SMALLEST_BESIDE_OTHERS_M, UNITS, guessed, likely_units, matched
from sessions.model.assumption import Assumption, Confidence, Origin, Subject
from sessions.model.scene import Scene
from sessions.scene_files.body_axes import (
    axes_assumption,
    file_type_of,
    grouped_assumptions,
    in_body_axes,
    scene_mesh_unit,
)
from sessions.scene_files.toml_table import nearest

MeshSource = str | Path | MeshData


@dataclass(frozen=True)
class MeshOptions:
    """The user's options for meshes, as in ``replay import``.

    Parameters
    ----------
    meshes : body name -> mesh file, or a mesh in metres and canonical axes; they win over the scene's.
    mesh_folder : a folder of mesh files, or a GLB of nodes, named like the bodies.
    mesh_units : m, cm or mm of the mesh files; ``""``: by their standard or size.
    mesh_axes : axes of the mesh files, as `mesh_axes_matrix` takes them; of several, ``BODY=NAME`` is for one body.
    colliders : a GLB with the colliders of an engine.
    collider_axes : axes of that file; ``""``: those of the recording.
    """

    meshes: Mapping[str, MeshSource] | None = None
    mesh_folder: str | Path | None = None
    mesh_units: str = ""
    mesh_axes: str | Sequence[str] = ()
    colliders: str | Path | None = None
    collider_axes: str = ""

    def axes_by_body(self, names: Sequence[str], poses: Convention) -> dict[str, str]:
        """Returns body -> axes, and ``""`` -> those of all others where they are given.

        Raises ImportFileError: unknown axes, or a body that is not there.
        """
        texts = [self.mesh_axes] if isinstance(self.mesh_axes, str) else self.mesh_axes
        chosen: dict[str, str] = {}
        for text in filter(None, texts):
            body, equals, axes = text.partition("=")
            if not equals or (body not in names and _is_axes(text, poses)):
                body, axes = "", text
            if body and body not in names:
                raise ImportFileError(f"--mesh-axes {text}: there is no body {body!r}{nearest(body, names)}")
            if not _is_axes(axes, poses):
                mesh_axes_or_refusal(axes, poses)
            chosen[body] = axes
        return chosen


MESH_OPTIONS: Final = tuple(one.name for one in fields(MeshOptions))


def _is_axes(text: str, poses: Convention) -> bool:
    try:
        mesh_axes_matrix(text, poses)
    except SessionError:
        return False
    return True


def mesh_axes_or_refusal(text: str, poses: Convention) -> None:
    """Raise ImportFileError where no axes of meshes have this name."""
    try:
        mesh_axes_matrix(text, poses)
    except SessionError as error:
        raise ImportFileError(str(error)) from None


@dataclass(frozen=True, eq=False)
class FileMesh:
    """A mesh as its file has it: its axes are the file's.

    Parameters
    ----------
    mesh : in metres.
    file : its name; ``""``: an array, in the axes of the recording.
    unit : assumed unit, with who says it.
    """

    mesh: MeshData
    file: str
    unit: Assumption | None = None
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class PlacedMeshes:
    """Meshes in the axes of their bodies, with everything that was assumed of their files.

    Parameters
    ----------
    meshes : body name -> mesh.
    from_options : bodies whose mesh the options give.
    assumptions : axes and units of the files.
    notes : sentences on which file is whose, and on guessed units.
    """

    meshes: dict[str, MeshData]
    from_options: tuple[str, ...] = ()
    assumptions: list[Assumption] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def placed_meshes(
    options: MeshOptions, scene: Scene, scene_meshes: Mapping[str, MeshData], names: Sequence[str], poses: Convention
) -> PlacedMeshes:
    """Returns the meshes of a scene and of the options in canonical axes; those of the options win.

    Parameters
    ----------
    scene, scene_meshes : what was declared, and its meshes as `scene_meshes` reads them.
    names : every body that there is.
    poses : the convention of the poses.

    Raises ImportFileError: a mesh for a body that is not there, unknown axes.
    """
    from_scene = {
        body.id: FileMesh(scene_meshes[body.id], body.mesh, scene_mesh_unit(body, scene_meshes[body.id]))
        for body in scene.bodies
        if body.mesh
    }
    given, notes = _given(options, names, poses)
    axes_by_body = options.axes_by_body(names, poses)
    for body in scene.bodies:
        if body.mesh and body.mesh_axes and body.id not in given:
            axes_by_body.setdefault(body.id, body.mesh_axes)
    placed = PlacedMeshes({**scene_meshes}, tuple(given), notes=notes)
    file_meshes = {**from_scene, **given}
    units = (replace(row.unit, bodies=(name,)) for name, row in file_meshes.items() if row.unit is not None)
    placed.assumptions.extend(grouped_assumptions(units))
    axes_rows: dict[str, Assumption] = {}
    for name, row in file_meshes.items():
        stated = axes_by_body.get(name, axes_by_body.get("", ""))
        if not row.file and not stated:
            placed.meshes[name] = row.mesh
            continue
        axes = axes_assumption(name, row.file or f"the array of {name}", stated, poses)
        axes_rows[name] = axes
        placed.meshes[name] = in_body_axes(row.mesh, axes.value, poses)
    placed.assumptions.extend(grouped_assumptions(axes_rows.values()))
    return placed


def _given(options: MeshOptions, names: Sequence[str], poses: Convention) -> tuple[dict[str, FileMesh], list[str]]:
    """Body -> mesh of the options, and sentences on the files of a folder."""
    from sessions.meshes.mesh_files import load_mesh

    given, notes = dict[str, FileMesh](), list[str]()
    for name, source in (options.meshes or {}).items():
        if name not in names:
            raise ImportFileError(f"there is no body {name!r} to put a mesh on{nearest(name, names)}")
        if isinstance(source, MeshData):
            given[name] = FileMesh(source, "")
        else:
            given[name] = _in_metres(
                load_mesh(source), Path(source).name, f"{name}: {Path(source).name}", options, poses
            )
    notes += [note for row in given.values() for note in row.notes]
    if options.mesh_folder is not None:
        bare = [name for name in names if name not in given]
        scale = UNITS[options.mesh_units] if options.mesh_units else None
        matches, without = matched(Path(options.mesh_folder), bare, scale)
        for name, match in matches.items():
            unit = _unit_assumption(match.file.name, match.mesh, match.scale, options, poses)
            given[name] = FileMesh(match.mesh, match.file.name, unit)
            notes.append(match.words)
        notes += without
    return _with_units_of_others(given), notes


def _with_units_of_others(given: dict[str, FileMesh]) -> dict[str, FileMesh]:
    """Meshes whose files look like metres beside files in a smaller unit, which they may have as well."""
    others = [
        row.unit.value
        for row in given.values()
        if row.unit and row.unit.origin is Origin.GUESS and row.unit.value != "m"
    ]
    if not others:
        return given
    smaller = max(others, key=others.count)
    changed = {}
    for name, row in given.items():
        unit = row.unit
        if unit is not None and unit.origin is Origin.GUESS and unit.value == "m" and smaller not in unit.alternatives:
            size = float((row.mesh.bounds[1] - row.mesh.bounds[0]).max())
            if size * UNITS[smaller] >= SMALLEST_BESIDE_OTHERS_M:
                reason = f"by its size; other mesh files are in {smaller}"
                alternatives = (*unit.alternatives, smaller)
                unit = replace(unit, confidence=Confidence.OPEN, reason=reason, alternatives=alternatives)
        changed[name] = replace(row, unit=unit)
    return changed


def _in_metres(mesh: MeshData, file: str, what: str, options: MeshOptions, poses: Convention) -> FileMesh:
    if options.mesh_units:
        factor, note = UNITS[options.mesh_units], ""
    else:
        factor, note = guessed(mesh, what)
    scaled = mesh if factor == 1.0 else MeshData(mesh.vertices * factor, mesh.faces)
    return FileMesh(scaled, file, _unit_assumption(file, scaled, factor, options, poses), (note,) if note else ())


def _unit_assumption(file: str, mesh: MeshData, factor: float, options: MeshOptions, poses: Convention) -> Assumption:
    """The unit of a mesh file: said, of its format, or by the size of its mesh, which is in metres."""
    unit = next(name for name, metres in UNITS.items() if metres == factor)
    origin, reason, alternatives = Origin.GUESS, "by its size", likely_units(mesh, unit)
    if options.mesh_units:
        origin, reason = Origin.USER, ""
    elif FORMAT_UNIT.get(file_type_of(file)) == unit:
        origin, reason = Origin.FORMAT, ""
    elif unit == poses.unit:
        reason, alternatives = f"by its size, and {poses.name} has this unit", (unit,)
    return Assumption(
        subject=Subject.MESH_UNIT,
        value=unit,
        origin=origin,
        confidence=Confidence.OPEN if origin is Origin.GUESS and len(alternatives) > 1 else Confidence.SURE,
        files=(file,),
        reason=reason,
        alternatives=alternatives,
    )
