"""Poses from a CSV, wide or long, of any convention: converted to the canonical frame, doubtful rows flagged."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sessions.conventions import Convention, convention, quaternion_from_euler
from sessions.errors import ImportFileError
from sessions.hand import HandTrack
from sessions.importers.csv_mapping import METRES, UNITY, CsvMapping, PoseColumns, read_mapping
from sessions.importers.csv_table import CsvTable
from sessions.importers.finish import MeshSource, Samples, counted, finished, usable_track
from sessions.live_contact import LiveContact
from sessions.mesh_data import MeshData
from sessions.scene import Scene
from sessions.session import Session
from sessions.track import Track

MESH_AXES = {
    "same": "mesh files have the axes of the converted session",
    "x-flipped": "mesh files were exported from Unity as glTF, which flips X instead of Z",
}

Rows = NDArray[np.bool_]


def read_csv(
    source: Path,
    *,
    mapping: str | Path | CsvMapping | None = None,
    convention: str | None = None,
    mesh_axes: str = "same",
    meshes: Mapping[str, MeshSource] | None = None,
    scene: Scene | None = None,
    scene_folder: str | Path = ".",
    proxies: bool | None = None,
) -> Session:
    """The session of a CSV file.

    Parameters
    ----------
    mapping : a mapping file or ``CsvMapping``; ``None``: the CSV of the README's Unity script.
    convention : a name in ``CONVENTIONS``; wins over the mapping's.
    mesh_axes : ``same``, or ``x-flipped`` for meshes that a glTF exporter of Unity wrote (it flips X, the poses flip Z:
        without this every mesh stands turned by 180 degrees about Y).
    meshes, scene, scene_folder, proxies : see ``sessions.importers.finish.finished``.

    Raises
    ------
    ImportFileError
        Names file, line and column.
    """
    if mesh_axes not in MESH_AXES:
        raise ImportFileError(f"no mesh_axes {mesh_axes!r}; there are: {', '.join(MESH_AXES)}")
    plan = UNITY if mapping is None else mapping if isinstance(mapping, CsvMapping) else read_mapping(mapping)
    axes = _axes(convention or plan.convention)
    table = CsvTable(source, plan.delimiter, plan.decimal)
    samples = _samples(table, plan, axes)
    session_meshes = {name: _turned(mesh, mesh_axes) for name, mesh in (meshes or {}).items()}
    return finished(samples, source, meshes=session_meshes, scene=scene, scene_folder=scene_folder, proxies=proxies)


def _axes(name: str) -> Convention:
    if not name:
        raise ImportFileError("the axes of the CSV are not known; name a convention (for Unity: unity)")
    return convention(name)


def _turned(mesh: MeshSource, mesh_axes: str) -> MeshSource:
    """Source: F_z F_m^-1 with F_m = diag(-1, 1, 1) is a half turn about Y."""
    if mesh_axes == "same":
        return mesh
    from sessions.meshes import load_mesh

    loaded = mesh if isinstance(mesh, MeshData) else load_mesh(mesh)
    return loaded.transformed(np.diag([-1.0, 1.0, -1.0, 1.0]))


def _samples(table: CsvTable, plan: CsvMapping, axes: Convention) -> Samples:
    tracks: dict[str, Track] = {}
    done = [
        f"axes {axes.name} ({axes.words}) to right-handed, +Y up, -Z forward",
        f"lengths in {plan.units} to m",
        f"clock in {plan.unit} to ns",
    ]
    if table.skipped:
        done.append(f"{table.skipped} rows left out that have too few or too many cells")
    for name, columns, rows in _bodies(table, plan):
        tracks[name], dropped, flagged = _track(table, plan, axes, columns, rows)
        done += counted(name, dropped, flagged)
    done += _unknown_kinds(table, plan)
    facts = {"source_units": plan.units, "handedness": axes.handedness, "clock": f"column {plan.time}, {plan.unit}"}
    return Samples(tracks, tuple(done), facts, (), _hands(table, plan), _contacts(table, plan))


def _bodies(table: CsvTable, plan: CsvMapping) -> Iterator[tuple[str, PoseColumns, Rows]]:
    """Each body with its columns and its rows."""
    if plan.bodies is not None:
        for name, columns in plan.bodies.items():
            yield name, columns, np.ones(len(table), dtype=np.bool_)
    elif plan.body is not None:
        names = table.texts(plan.name)
        poses = np.ones(len(table), np.bool_) if plan.rows is None else table.texts(plan.rows.column) == plan.rows.pose
        for name in dict.fromkeys(names[poses].tolist()):
            if not name:
                raise ImportFileError(f"{table.source}: column {plan.name!r}: a pose has no body; fill in the cell")
            yield name, plan.body, poses & (names == name)


def _track(
    table: CsvTable, plan: CsvMapping, axes: Convention, columns: PoseColumns, rows: Rows
) -> tuple[Track, int, int]:
    numbers = table.numbers(columns.numbers, rows)
    stamps = table.stamps(plan.time, plan.unit, rows)
    valid = table.flags(columns.valid, rows) if columns.valid else np.ones(len(numbers), dtype=np.bool_)
    turn = numbers[:, 3:]
    if columns.euler:
        turn = quaternion_from_euler(np.radians(turn) if columns.degrees else turn, columns.order)
    place = axes.points(numbers[:, :3]) * METRES[plan.units]
    return usable_track(stamps, place, axes.quaternions(turn), valid)


def _of_kind(table: CsvTable, plan: CsvMapping, word: str) -> Rows:
    if plan.rows is None or not word:
        return np.zeros(len(table), dtype=np.bool_)
    chosen: Rows = table.texts(plan.rows.column) == word
    return chosen


def _unknown_kinds(table: CsvTable, plan: CsvMapping) -> list[str]:
    if plan.rows is None:
        return []
    known = {plan.rows.pose, plan.rows.enter, plan.rows.exit, plan.rows.trigger}
    others = [word for word in table.texts(plan.rows.column).tolist() if word not in known]
    return [f"{len(others)} rows left out of unknown kind {sorted(set(others))[0]!r}"] if others else []


def _contacts(table: CsvTable, plan: CsvMapping) -> tuple[LiveContact, ...]:
    if plan.rows is None:
        return ()
    found = []
    for phase, word in (("enter", plan.rows.enter), ("exit", plan.rows.exit)):
        rows = _of_kind(table, plan, word)
        if not rows.any():
            continue
        stamps = table.stamps(plan.time, plan.unit, rows).tolist()
        ends = zip(table.texts(plan.name)[rows], table.texts(plan.rows.other)[rows], strict=True)
        found += [LiveContact(stamp, str(a), str(b), phase) for stamp, (a, b) in zip(stamps, ends, strict=True)]
    return tuple(sorted(found, key=lambda contact: contact.time_ns))


def _hands(table: CsvTable, plan: CsvMapping) -> dict[str, HandTrack]:
    if plan.rows is None:
        return {}
    pulled = _of_kind(table, plan, plan.rows.trigger)
    hands = {}
    names = table.texts(plan.name)
    for name in dict.fromkeys(names[pulled].tolist()):
        rows = pulled & (names == name)
        stamps, first = np.unique(table.stamps(plan.time, plan.unit, rows), return_index=True)
        value = table.numbers((plan.rows.value,), rows)[first, 0]
        hands[f"student/{_side(name)}"] = HandTrack(stamps, np.nan_to_num(value))
    return hands


def _side(name: str) -> str:
    return next((side for side in ("left", "right") if side in name.lower()), name)
