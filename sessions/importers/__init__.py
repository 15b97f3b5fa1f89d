"""Recordings of other programs, one importer per format; conversions and dropped rows are recorded in the metadata."""

from dataclasses import replace
from importlib import import_module
from importlib.metadata import entry_points
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from sessions.errors import ImportFileError, SessionError
from sessions.input_files import check_regular
from sessions.model.session import Session

if TYPE_CHECKING:
    from sessions.importers.given_meshes import MeshOptions

IMPORTERS: Final[dict[str, str]] = {
    "aframe": "sessions.importers.aframe:read_aframe",
    "csv": "sessions.importers.csv_file:read_csv",
    "hands": "sessions.importers.hands.hand_csv:read_hands",
    "mcap": "sessions.importers.mcap_file:read_mcap",
    "mjcf": "sessions.importers.mjcf_motion:read_mjcf",
    "optitrack": "sessions.importers.optitrack:read_optitrack",
    "ros2": "sessions.importers.mcap_file:read_mcap",
    "usd": "sessions.importers.usd_motion:read_usd",
    "uxf": "sessions.importers.uxf:read_uxf",
    "xdf": "sessions.importers.xdf:read_xdf",
}
"""Format -> ``module:function`` that reads a path as a ``Session``; those of other packages are entry points."""

AUTO: Final = "auto"
"""The format that looks at the source first; why it took it for what it did is the fact ``taken_for``."""

FOLDERS: Final = ("uxf", AUTO)
"""Formats whose source may be a folder."""

ROBOTS: Final = ("mcap", "mjcf", "ros2", "usd")
"""Formats in which names like ``left_wheel`` mean no headset or controller."""

COMMON: Final = ("scene", "scene_folder")
"""Options of every importer above beside those of ``MeshOptions``; see ``sessions.importers.finish.finished``."""

ENTRY_POINT_GROUP: Final = "vrlab_replay.importers"


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
    from sessions.importers.finish import finished
    from sessions.importers.given_meshes import MESH_OPTIONS, MeshOptions

    path = Path(source)
    common = {name: options.pop(name) for name in COMMON if name in options}
    given = MeshOptions(**{name: options.pop(name) for name in MESH_OPTIONS if name in options})
    if isinstance(options.get("mapping"), str | Path):
        given = _with_mapped(given, options["mapping"])
    name, why = _taken_for(format, path, is_mapped="mapping" in options)
    session = _read(name, path, options)
    if why:
        session = replace(session, facts={**session.facts, "taken_for": f"{name}, because {why}"})
    return finished(session, path, given, stand_ins=name not in ROBOTS, **common)


def _with_mapped(given: "MeshOptions", mapping: str | Path) -> "MeshOptions":
    """The mesh options, completed from a mapping where the call leaves them open."""
    from sessions.importers.csv_mapping import mapped_mesh_options

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
    from sessions.importers.recognition import joints_in, recognised

    if format == AUTO:
        return recognised(path)
    joints = joints_in(path) if format == "csv" and not is_mapped else ""
    return ("hands", joints) if joints else (format, "")


def _read(format: str, path: Path, options: dict[str, Any]) -> Session:
    """The poses of a source, and what else is in it."""
    from sessions.importers.given_meshes import MESH_OPTIONS

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
