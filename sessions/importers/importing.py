"""Imports a recording of another program: tells its format, reads its poses, and completes them with meshes.

A source is read by the importer of its format. What it lacks comes from the options, the scene and stand-ins, and
everything that was assumed is recorded with who says it.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from importlib import import_module
from importlib.metadata import entry_points
from inspect import signature
from operator import attrgetter
from pathlib import Path
from typing import Any, Final

import numpy as np

from sessions.errors import ImportFileError, SessionError
from sessions.importers import AUTO, ENTRY_POINT_GROUP, FOLDERS, IMPORTERS
from sessions.importers.csv_mapping import mapped_mesh_options
from sessions.importers.given_meshes import MESH_OPTIONS, MeshOptions, PlacedMeshes, placed_meshes
from sessions.importers.ledger import FACT, ledger_of
from sessions.importers.recognition import joints_in, recognised_format
from sessions.input_files import check_regular
from sessions.mesh_data import MeshData
from sessions.meshes.conventions import Convention
from sessions.meshes.mesh_axes import mesh_axes_alternatives, mesh_axes_description
from sessions.meshes.mesh_match import ColliderFile
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
from sessions.model.samples import Status
from sessions.model.scene import Scene, SceneBody
from sessions.model.session import Session
from sessions.names import SIDES, is_hand, is_head, name_tokens
from sessions.scene_files.scene_meshes import (
    COLLIDER_AXES,
    scene_meshes,
    session_colliders,
    with_collider_file,
    with_meshes,
)
from sessions.scene_files.scene_toml import scene_to_toml, with_recorded_groups

ROBOTS: Final = ("mcap", "mjcf", "ros2", "usd")
"""Formats in which names like ``left_wheel`` mean no headset or controller."""

COMMON: Final = ("scene", "scene_folder")
"""Options of every importer above beside those of ``MeshOptions``; see `finished`."""

PROXY_FACES = 2000

MOST_NODES = 8
"""Nodes of no body that the ledger names."""

NO_MESHES = MeshOptions()


def importer_names() -> list[str]:
    """Every format that ``import_session`` takes."""
    outside = sorted(point.name for point in entry_points(group=ENTRY_POINT_GROUP))
    return [*IMPORTERS, AUTO] + [name for name in outside if name not in IMPORTERS]


def import_session(format: str, source: str | Path, **options: Any) -> Session:
    """Read a recording of another program as a session in the canonical frame.

    Parameters
    ----------
    format : a name in ``IMPORTERS`` or of an installed package.
    source : the file, or the folder of a format in ``FOLDERS``.
    options : keywords of that importer, those in ``COMMON``, and the fields of ``MeshOptions``.

    Raises ``ImportFileError``: an unknown format or option, or a file that is not what it should be; names file, line
    and column.
    """
    path = Path(source)
    common = {name: options.pop(name) for name in COMMON if name in options}
    given = MeshOptions(**{name: options.pop(name) for name in MESH_OPTIONS if name in options})
    if isinstance(options.get("mapping"), str | Path):
        given = _with_mapped(given, options["mapping"])
    name, why = _taken_for(format, path, is_mapped="mapping" in options)
    session = _read(name, path, options)
    if why:
        session = replace(session, facts={**session.facts, "taken_for": f"{name}, because {why}"})
    return finish_import(session, path, given, stand_ins=name not in ROBOTS, **common)


def _with_mapped(given: MeshOptions, mapping: str | Path) -> MeshOptions:
    """The mesh options, completed from a mapping where the call leaves them open."""
    mapped = mapped_mesh_options(mapping)
    return replace(
        given,
        mesh_axes=given.mesh_axes or mapped.mesh_axes,
        mesh_units=given.mesh_units or mapped.mesh_units,
        collider_axes=given.collider_axes or mapped.collider_axes,
    )


def makes_bodies(format: str, source: str | Path) -> bool:
    """Whether an import makes bodies and groups of its own, as of tracked hands, so that a scene adds to them."""
    return _taken_for(format, Path(source))[0] == "hands"


def _taken_for(format: str, path: Path, *, is_mapped: bool = False) -> tuple[str, str]:
    """The format to read a source in, and why where it is looked for; an error where there is no such source.

    ``is_mapped``: a mapping says what the columns of a CSV are.
    """
    if not (path.is_file() or (path.is_dir() and format in FOLDERS)):
        if not path.is_dir():
            check_regular(path, "recording", ImportFileError)
        raise ImportFileError(f"{path} does not exist or is no file; check the path")
    if format == AUTO:
        return recognised_format(path)
    joints = joints_in(path) if format == "csv" and not is_mapped else ""
    return ("hands", joints) if joints else (format, "")


def _read(format: str, path: Path, options: dict[str, Any]) -> Session:
    """The poses of a source, and what else is in it."""
    try:
        read = _importer(format)
        known = [*signature(read).parameters][1:]
        for option in options:
            if option not in known:
                accepted = ", ".join([*known, *COMMON, *MESH_OPTIONS])
                raise ImportFileError(f"importer {format!r} has no option {option!r}; it has: {accepted}")
        session: Session = read(path, **options)
    except (SessionError, OSError):
        raise
    except Exception as error:  # of another package; ours raise what they refuse
        why = f"{type(error).__name__}: {error}"
        raise ImportFileError(f"importer {format!r} failed ({why}); repair or remove its package") from error
    return session


def _importer(name: str) -> Any:
    if name in IMPORTERS:
        module, function = IMPORTERS[name].split(":")
        return getattr(import_module(module), function)
    for point in entry_points(group=ENTRY_POINT_GROUP, name=name):
        return point.load()
    raise ImportFileError(f"no importer {name!r}; there are: {', '.join(importer_names())}")


def finish_import(
    session: Session,
    source: Path,
    given: MeshOptions = NO_MESHES,
    *,
    scene: Scene | None = None,
    scene_folder: str | Path = ".",
    stand_ins: bool = False,
) -> Session:
    """The session of a source with its meshes and with everything that was assumed of it.

    Parameters
    ----------
    given : meshes and colliders beside the recording; they win over the scene's.
    scene : declared bodies, pairs and effects; its mesh paths are relative to ``scene_folder``.
    stand_ins : whether headset and controllers get a mesh where none is given at all.

    Raises ``ImportFileError``: no pose that is not lost, a mesh for a body that is not there, unknown axes.
    """
    _check_poses(session, source)
    declared = session.scene if scene is None else with_recorded_groups(scene, session.scene)
    poses = pose_convention(session.facts)
    names = [*session.names, *(body.id for body in declared.bodies if body.id not in session.names)]
    placed = PlacedMeshes({})
    if given != NO_MESHES or scene:
        try:
            placed = placed_meshes(given, declared, scene_meshes(scene, scene_folder) if scene else {}, names, poses)
        except ImportFileError as error:
            raise ImportFileError(f"{source}: {error}") from None
    meshes = {**session.meshes, **placed.meshes}
    facts = {"source_file": source.name, "conversions": "none", **session.facts}
    ledger = ledger_of(facts) if placed.meshes else None
    if ledger is not None:
        for name, mesh in placed.meshes.items():  # their readers drop no face
            ledger.book("faces", name, read=len(mesh.faces), kept=len(mesh.faces))
        facts[FACT] = ledger.as_text()
    if stand_ins and not meshes:
        declared = _with_proxies(declared, session.names, meshes)
    complete = replace(
        session,
        meshes=meshes,
        scene=declared,
        facts=facts,
        events=tuple(sorted(session.events, key=attrgetter("time_ns"))),
        live_contacts=tuple(sorted(session.live_contacts, key=attrgetter("time_ns"))),
    )
    if placed.from_options or placed.notes:
        by_user = {name: meshes[name] for name in placed.from_options}
        complete = with_meshes(complete, by_user, placed.notes)
    if given.colliders or complete.scene.colliders:
        complete = _with_colliders(complete, given, scene_folder)
    assumed = [*placed.assumptions, *collider_assumptions(complete, given, poses)]
    return with_assumptions(complete, assumed)


def _with_colliders(session: Session, given: MeshOptions, scene_folder: str | Path) -> Session:
    """The session with the colliders of the file that the options give, or else its scene."""
    colliders = session_colliders(session, "." if given.colliders else scene_folder, given.colliders or "")
    if colliders is None:
        return session
    axes = given.collider_axes or COLLIDER_AXES
    return _with_collider_account(with_collider_file(session, colliders, axes), colliders)


def _with_collider_account(session: Session, colliders: ColliderFile) -> Session:
    """The session with the nodes of its colliders' file in its ledger."""
    ledger = ledger_of(session.facts)
    if ledger is None:
        return session
    unowned = len(colliders.unowned)
    named = ", ".join(colliders.unowned[:MOST_NODES])
    ledger.book(
        "nodes",
        "colliders",
        read=colliders.count + unowned,
        kept=colliders.count,
        dropped={f"that belong to no body: {named}": unowned},
    )
    return replace(session, facts={**session.facts, FACT: ledger.as_text()})


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


def with_assumptions(session: Session, assumptions: Sequence[Assumption]) -> Session:
    """Returns the session with these assumptions beside those that it keeps; a source of none is canonical."""
    if not assumptions and ASSUMPTIONS_FACT in session.facts:
        return session
    kept = assumptions_of(session.facts) or ()
    return replace(session, facts={**session.facts, ASSUMPTIONS_FACT: assumptions_fact([*kept, *assumptions])})


def _check_poses(session: Session, source: Path) -> None:
    """Refuse a recording without a pose, or with none that is not lost."""
    status = session.frames.status
    if (status == Status.ABSENT).all():
        raise ImportFileError(f"{source}: there is no pose in it; check that this is the recording")
    if np.isin(status, (Status.ABSENT, Status.LOST)).all():
        conversions = session.facts.get("conversions", "").split("; ")
        why = "; ".join(conversion for conversion in conversions if "lost" in conversion) or "the source flags them"
        raise ImportFileError(f"{source}: every pose in it is lost ({why}); record it again, or choose other columns")


def proxy_for(name: str) -> str:
    """The instrument that can stand in for a body of this name, or ``""``; ``left`` alone is a controller."""
    if is_head(name):
        return "proxy_headset"
    is_side = len(tokens := name_tokens(name)) == 1 and tokens[0] in SIDES
    return "proxy_wand" if is_side or is_hand(name) else ""


def _with_proxies(scene: Scene, names: Iterable[str], given: dict[str, MeshData]) -> Scene:
    rows = {name: proxy_for(name) for name in names}
    if not any(rows.values()):
        return scene
    from sessions.glassware.catalogue import make_instrument

    bodies = {body.id: body for body in scene.bodies}
    for name, row in rows.items():
        if row:
            given[name] = make_instrument(row, PROXY_FACES).mesh
            body = bodies.get(name, SceneBody(id=name))
            bodies[name] = replace(body, instrument=row, proxy=True, extra={**body.extra, "faces": PROXY_FACES})
    marked = replace(scene, bodies=tuple(bodies.values()))
    return replace(marked, text=scene_to_toml(marked))
