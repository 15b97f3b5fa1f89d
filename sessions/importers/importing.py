"""Imports a recording of another program: tells its format, reads its poses, and completes them with meshes.

A source is read by the importer of its format, which hands over a `PoseTable` for each body and a `SourceFrame` for the
meaning of the numbers. `session_of_tables` is their one way into the canonical frame: stamps that increase, axes,
metres; what is dropped is in the ledger. `finish_import` adds what the source lacks, from the options, the scene and
stand-ins. Everything that was assumed is recorded with who says it.
"""

import math
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from importlib.metadata import entry_points
from inspect import signature
from operator import attrgetter
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from sessions.errors import ImportFileError, SessionError
from sessions.geometry.rotations import quaternion_inverse
from sessions.importers import AUTO, ENTRY_POINT_GROUP, FOLDERS, IMPORTERS
from sessions.importers.given_meshes import (
    COLLIDER_AXES_KEY,
    MESH_AXES_KEY,
    MESH_OPTIONS,
    MESH_UNITS_KEY,
    MeshOptions,
    PlacedMeshes,
    placed_meshes,
)
from sessions.importers.ledger import FACT, FLAGGED, POSES, Ledger, Numbers, Rows, Stamps, increasing_rows, ledger_of
from sessions.importers.unstated_units import length_unit_assumption, room_radius, usual_length_unit
from sessions.input_files import check_regular, open_input, parse_toml, read_text
from sessions.mesh_data import MeshData
from sessions.meshes.conventions import CONVENTIONS, Convention, pose_axes_alternatives
from sessions.meshes.conventions import convention as convention_named
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
from sessions.model.scene import Scene, SceneBody
from sessions.model.session import ScalarTrack, Session, Status, Track
from sessions.names import SIDES, is_hand, is_head, name_tokens
from sessions.quantities import number as number_text
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
"""Options of every importer above beside those of ``MeshOptions``; see `finish_import`."""

PROXY_FACES = 2000

MOST_NODES = 8
"""Nodes of no body that the ledger names."""

NO_MESHES = MeshOptions()

QUATERNION_TOLERANCE: Final = 1e-3
"""A quaternion whose norm is further off 1 is no rotation: its row is flagged as lost."""
METRES_PER_UNIT: Final[Mapping[str, float]] = {
    "m": 1.0,
    "cm": 0.01,
    "mm": 0.001,
    "meter": 1.0,
    "meters": 1.0,
    "metres": 1.0,
    "centimeters": 0.01,
    "millimeters": 0.001,
    "inches": 0.0254,
    "feet": 0.3048,
    "inch": 0.0254,
    "ft": 0.3048,
}
BODY_TO_WORLD, WORLD_TO_BODY = "body-to-world", "world-to-body"
ROTATIONS: Final = (BODY_TO_WORLD, WORLD_TO_BODY)
"""Directions in which a source may write rotations: that of a pose, and its inverse."""
INVERTED: Final = f"rotations {WORLD_TO_BODY} to {BODY_TO_WORLD}"
"""The sentence on rotations that were inverted."""
LENGTH_UNITS: Final = ("m", "cm", "mm")
"""Units that are tried in place of one that is open."""


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
        given = with_mapped_meshes(given, options["mapping"])
    name, why = _taken_for(format, path, is_mapped="mapping" in options)
    session = _read(name, path, options)
    if why:
        session = replace(session, facts={**session.facts, "taken_for": f"{name}, because {why}"})
    return finish_import(session, path, given, stand_ins=name not in ROBOTS, **common)


def with_mapped_meshes(given: MeshOptions, mapping: str | Path) -> MeshOptions:
    """The mesh options; what the call leaves open comes from a mapping.

    Raises ImportFileError: no TOML, or a key of another type.
    """
    table = parse_toml(read_text(mapping, "mapping", ImportFileError), Path(mapping).name, ImportFileError)
    mesh_axes = table.text_or_texts(MESH_AXES_KEY)
    mesh_units = table.text_or_texts(MESH_UNITS_KEY)
    collider_axes = table.text(COLLIDER_AXES_KEY)
    return replace(
        given,
        mesh_axes=given.mesh_axes or mesh_axes,
        mesh_units=given.mesh_units or mesh_units,
        collider_axes=given.collider_axes or collider_axes,
    )


def makes_bodies(format: str, source: str | Path) -> bool:
    """Whether an import makes bodies and groups of its own, as of tracked hands, so that a scene adds to them."""
    return _taken_for(format, Path(source))[0] == "hands"


def _taken_for(format: str, path: Path, *, is_mapped: bool = False) -> tuple[str, str]:
    """The format to read a source in, and why where it is looked for; an error where there is no such source.

    ``is_mapped``: a mapping says what the columns of a CSV are.
    """
    # Formats are told by what their importers know of them, and these import this module.
    from sessions.importers.recognition import joints_in, recognised_format

    if not (path.is_file() or (path.is_dir() and format in FOLDERS)):
        if not path.is_dir():
            check_regular(path, "recording", ImportFileError)
        raise ImportFileError(f"{path} does not exist or is no file; check the path")
    if path.is_file():
        with open_input(path, "recording", ImportFileError) as stream:
            if not stream.read(1) and format in (*IMPORTERS, AUTO):
                raise ImportFileError(f"recording {path} is empty; copy or record it again")
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


class PoseTable(NamedTuple):
    """The rows of one body: (n,) nanoseconds, (n, 3) and (n, 4) in axes and units of the source, (n,) or ``None``."""

    times_ns: Stamps
    positions: Numbers
    quaternions_xyzw: Numbers
    valid: Rows | None = None


class Stream(NamedTuple):
    """A number over time beside the poses: (n,) nanoseconds and (n,) values; NaN where nothing was measured."""

    name: str
    times_ns: Stamps
    values: Numbers
    unit: str = ""


@dataclass(frozen=True)
class SourceFrame:
    """The units and axes of a source, and their origin; ``clock`` is a sentence for a reader.

    ``assumed``: sentences on what no file said. ``others``: units of times and angles, and orders of rotations.
    ``handedness_is_known``: axes of the other handedness are no alternatives.
    ``units_reason``: why a guessed unit is sure; ``""``: by how far poses are from the origin.
    ``inverse_rotations``: rotations are from the world to the body.
    """

    axes: Convention
    units: str
    clock: str
    assumed: tuple[str, ...] = ()
    axes_origin: Origin = Origin.FORMAT
    axes_confidence: Confidence = Confidence.SURE
    axes_reason: str = "usual for this format"
    handedness_is_known: bool = False
    units_origin: Origin = Origin.FORMAT
    units_reason: str = ""
    clock_origin: Origin = Origin.FORMAT
    others: tuple[Assumption, ...] = ()
    inverse_rotations: bool = False

    @classmethod
    def in_axes(
        cls,
        convention: str | None,
        usual: str,
        units: str,
        clock: str,
        assumed: Sequence[str] = (),
        confidence: Confidence = Confidence.SURE,
    ) -> "SourceFrame":
        """In the axes that somebody named, else in those that are usual for a source, which is then assumed.

        ``units``: ``""`` where the file states none; then that of the axes, or metres. ``confidence``: how sure the
        usual axes are.
        """
        axes = convention_named(convention or usual)
        notes = [] if convention else [f"axes {axes.name} ({axes.description})"]
        unit = units or usual_length_unit(axes)
        if not units:
            notes.append(f"lengths in {unit}")
        return cls(
            axes=axes,
            units=unit,
            clock=clock,
            assumed=(*notes, *assumed),
            axes_origin=Origin.USER if convention else Origin.GUESS,
            axes_confidence=Confidence.SURE if convention else confidence,
            units_origin=Origin.FILE if units else Origin.GUESS,
        )


def session_of_tables(
    tables: Mapping[str, PoseTable],
    frame: SourceFrame,
    ledger: Ledger,
    notes: Sequence[str] = (),
    streams: Iterable[Stream] = (),
    made: Mapping[str, Track] | None = None,
) -> Session:
    """Tables in the canonical frame and metres, and numbers by their names.

    Every conversion and the ledger are among the facts. Of several streams of one name the later ones are numbered.
    ``made``: tracks that are in that frame already, such as those of capsules between joints.

    Raises ``ImportFileError``: a clock starts again.
    """
    axes = frame.axes
    done = []
    if not axes.is_canonical:
        done.append(f"axes {axes.name} ({axes.description}) to right-handed, +Y up, -Z forward")
    if METRES_PER_UNIT[frame.units] != 1.0:
        done.append(f"lengths in {frame.units} to m")
    if frame.inverse_rotations:
        done.append(INVERTED)
    done += notes
    tracks: dict[str, Track] = dict(made or {})
    for name, table in tables.items():
        tracks[name] = track_of(name, table, frame, ledger)
        if not len(table.times_ns):
            done.append(f"{name}: there is no sample of it")
    scalars: dict[str, ScalarTrack] = {}
    for stream in streams:
        name = numbered_name(stream.name, scalars)
        if name != stream.name:
            done.append(f"scalar {name}: another of the name {stream.name}")
        keep = increasing_rows(f"scalar {name}", stream.times_ns, (stream.values,), ledger)
        scalars[name] = ScalarTrack(stream.times_ns[keep], stream.values[keep], stream.unit)
    facts = {
        "conversions": "; ".join(_grouped_notes(done)) or "none",
        "source_units": frame.units,
        "source_convention": axes.name,
        "handedness": axes.handedness,
        "clock": frame.clock,
        FACT: ledger.as_text(),
    }
    assumed = [*frame.assumed, *_names_alike(tracks)]
    if assumed:
        facts["assumed"] = "; ".join(assumed)
    facts[ASSUMPTIONS_FACT] = assumptions_fact(pose_assumptions(frame, tracks.values()))
    return replace(Session.from_tracks(tracks, facts=facts), scalars=scalars)


def _names_alike(names: Iterable[str]) -> Iterator[str]:
    """Yields a sentence on each two bodies whose names differ in nothing but small and capital letters, and spaces."""
    known: dict[str, str] = {}
    for name in names:
        first = known.setdefault("".join(name.split()).casefold(), name)
        if first != name:
            yield f"{first!r} and {name!r} are two bodies"


def track_of(name: str, table: PoseTable, frame: SourceFrame, ledger: Ledger) -> Track:
    """The rows whose stamps increase, in the canonical frame.

    Rows that hold no rotation are flagged as lost, and keep their numbers; the account of ``poses`` says why.
    """
    keep = increasing_rows(name, table.times_ns, (table.positions, table.quaternions_xyzw), ledger)
    positions = frame.axes.points(table.positions[keep]) * METRES_PER_UNIT[frame.units]
    quaternions = frame.axes.quaternions(table.quaternions_xyzw[keep])
    if frame.inverse_rotations:
        quaternions = quaternion_inverse(quaternions)
    claimed = np.ones(len(positions), dtype=np.bool_) if table.valid is None else table.valid[keep]
    pose = np.isfinite(positions).all(axis=1) & is_rotation(quaternions)
    reasons = _no_pose_reasons(positions[claimed & ~pose], quaternions[claimed & ~pose])
    lost = {FLAGGED: int((~claimed).sum()), **reasons}
    ledger.book(POSES, name, read=len(pose), kept=int((claimed & pose).sum()), dropped=lost)
    return Track(table.times_ns[keep], positions, quaternions, claimed & pose)


def _no_pose_reasons(positions: Numbers, quaternions: Numbers) -> dict[str, int]:
    """Why rows hold no pose, each reason with its count: positions (n, 3) and quaternions (n, 4)."""
    is_missing = ~(np.isfinite(positions).all(axis=1) & np.isfinite(quaternions).all(axis=1))
    reasons = {"with a missing number": int(is_missing.sum())}
    if not is_missing.all():
        with np.errstate(over="ignore"):
            lengths = np.sqrt((quaternions[~is_missing] ** 2).sum(axis=1))
        shortest, longest = (number_text(float(value), digits=4) for value in (lengths.min(), lengths.max()))
        span = shortest if shortest == longest else f"{shortest} to {longest}"
        reasons[f"with a quaternion of length {span} in place of 1"] = len(lengths)
    return reasons


def is_rotation(quaternions: Numbers) -> Rows:
    """Whether each quaternion (n, 4) is one of length 1, (n,)."""
    with np.errstate(over="ignore", invalid="ignore"):
        norm = np.sqrt((quaternions**2).sum(axis=1))
    return np.abs(norm - 1.0) <= QUATERNION_TOLERANCE


def is_inverse(rotations: str | None) -> bool:
    """Whether a source writes rotations from the world to the body.

    Raises ImportFileError: it is none of ``ROTATIONS``.
    """
    if rotations and rotations not in ROTATIONS:
        raise ImportFileError(f"no rotations {rotations!r}; there are: {', '.join(ROTATIONS)}")
    return rotations == WORLD_TO_BODY


def _grouped_notes(notes: Iterable[str]) -> list[str]:
    """Notes of the same words about several things as one: ``a, b: 3 rows dropped``."""
    about: dict[str, list[str]] = {}
    for note in notes:
        what, colon, text = note.partition(": ")
        about.setdefault(colon + text or note, []).append(what if colon else "")
    return [", ".join(filter(None, dict.fromkeys(names))) + text for text, names in about.items()]


def numbered_name(name: str, taken: Container[str]) -> str:
    """The name, or where it is taken the name with the first number that is free: ``cup (2)``."""
    number, free = 1, name
    while free in taken:
        number += 1
        free = f"{name} ({number})"
    return free


def pose_assumptions(frame: SourceFrame, tracks: Iterable[Track]) -> tuple[Assumption, ...]:
    """Returns what was assumed of the poses of a source, which are in metres as their unit was taken."""
    is_guess = frame.axes_origin is Origin.GUESS
    alternatives = pose_axes_alternatives(frame.axes)
    if frame.handedness_is_known:
        alternatives = tuple(name for name in alternatives if CONVENTIONS[name].handedness == frame.axes.handedness)
    axes = Assumption(
        subject=Subject.POSE_AXES,
        value=frame.axes.name,
        origin=frame.axes_origin,
        confidence=frame.axes_confidence,
        description="" if frame.axes.description == frame.axes.name else frame.axes.description,
        reason=frame.axes_reason if is_guess else "",
        alternatives=alternatives if is_guess else (),
    )
    handed_origin, reason = frame.axes_origin, ""
    if frame.axes.assumed_handedness:
        handed_origin, reason = Origin.GUESS, "the axes as text leave it out"
    handedness = Assumption(Subject.HANDEDNESS, frame.axes.handedness, handed_origin, reason=reason)
    clock = Assumption(Subject.CLOCK, frame.clock, frame.clock_origin)
    return axes, handedness, length_unit(frame, tracks), clock, *frame.others


def length_unit(frame: SourceFrame, tracks: Iterable[Track]) -> Assumption:
    """Returns the unit of lengths; where nobody states it, tracks in metres tell whether it is plausible."""
    alternatives = (frame.units, *(unit for unit in LENGTH_UNITS if unit != frame.units))
    if frame.units_origin is Origin.GUESS:
        return length_unit_assumption(frame.units, room_radius(tracks), frame.units_reason, alternatives)
    return Assumption(Subject.LENGTH_UNIT, frame.units, frame.units_origin, alternatives=alternatives)


def number(value: Any) -> float:
    """A number of a decoded message as float64; NaN where it is none."""
    fits = isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300
    return float(value) if fits else math.nan


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
    _refuse_without_usable_poses(session, source)
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
    if not file:
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


def _refuse_without_usable_poses(session: Session, source: Path) -> None:
    """Refuse a recording without a pose, or with none that is not lost."""
    status = session.frames.status
    if (status == Status.ABSENT).all():
        raise ImportFileError(f"{source}: there is no pose in it; check that this is the recording")
    if np.isin(status, (Status.ABSENT, Status.LOST)).all():
        ledger = ledger_of(session.facts)
        poses = [] if ledger is None else [entry for entry in ledger if entry.kind == POSES]
        why = "; ".join(Ledger(source, poses).sentences()) or "the source flags them"
        raise ImportFileError(
            f"{source}: every pose in it is lost ({why}); record it again, or choose other columns or topics"
        )


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
