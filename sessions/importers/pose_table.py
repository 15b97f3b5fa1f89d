"""Poses as their source has them, and their one way into the canonical frame: axes, lengths, clock."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sessions.errors import ImportFileError
from sessions.importers.finish import Imported, counted, usable_track
from sessions.meshes.conventions import Convention
from sessions.model.track import Track

LARGEST_SECONDS: Final = 9.0e9  # Just below what int64 nanoseconds hold


class PoseTable(NamedTuple):
    """The rows of one body: (n,) nanoseconds, (n, 3) and (n, 4) in axes and units of the source, (n,) or ``None``."""

    times_ns: NDArray[np.int64]
    positions: NDArray[np.float64]
    quaternions_xyzw: NDArray[np.float64]
    valid: NDArray[np.bool_] | None = None


@dataclass(frozen=True)
class SourceFrame:
    """What the numbers of a source mean; ``clock`` is a sentence for a reader, ``assumed`` what no file said."""

    axes: Convention
    units: str
    metres: float
    clock: str
    clock_unit: str = "s"
    assumed: tuple[str, ...] = ()


def imported(tables: Mapping[str, PoseTable], frame: SourceFrame, notes: Sequence[str] = ()) -> Imported:
    """The tables in the canonical frame and metres, with every conversion in the metadata."""
    axes = frame.axes
    done = [
        f"axes {axes.name} ({axes.words}) to right-handed, +Y up, -Z forward",
        f"lengths in {frame.units} to m",
        *([f"clock in {frame.clock_unit} to ns"] if frame.clock_unit != "ns" else []),
        *notes,
    ]
    tracks: dict[str, Track] = {}
    for name, table in tables.items():
        tracks[name], dropped, flagged = usable_track(*in_frame(table, frame))
        done += counted(name, dropped, flagged)
    facts = {
        "source_units": frame.units,
        "source_convention": axes.name,
        "handedness": axes.handedness,
        "clock": frame.clock,
    }
    if frame.assumed:
        facts["assumed"] = "; ".join(frame.assumed)
    return Imported(tracks, tuple(done), facts)


def in_frame(table: PoseTable, frame: SourceFrame) -> tuple[NDArray[Any], ...]:
    """Stamps, positions, quaternions and validity of a table, in the canonical frame and metres."""
    valid = np.ones(len(table.times_ns), dtype=np.bool_) if table.valid is None else table.valid
    place, turn = frame.axes.points(table.positions) * frame.metres, frame.axes.quaternions(table.quaternions_xyzw)
    return table.times_ns, place, turn, valid


def stamps_of(seconds: NDArray[np.float64], where: str) -> NDArray[np.int64]:
    """Seconds as int64 nanoseconds, (n,); ImportFileError where one is missing or beyond int64."""
    wrong = np.flatnonzero(~(np.abs(seconds) < LARGEST_SECONDS))
    if len(wrong):
        raise ImportFileError(f"{where}: row {int(wrong[0]) + 1} has no time in seconds; remove it or repair the file")
    return np.rint(seconds * 1e9).astype(np.int64)
