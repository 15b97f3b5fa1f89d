"""Where surfaces meet: a point per contact, and the curve in which the surfaces cut each other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from cdcore import Detection, FaceSets
from cdcore.numerics import FloatArray, place_points
from replay.comparison.outcome import Comparison, Outcome
from replay.outputs.palette import FOUND, OUTCOMES
from replay.outputs.rerun_log.columns import RecordingClock, RecordingWriter, entity, packed
from replay.prepare.assembly import Assembly

DRAWN_CONTACTS: Final = 20_000
DRAWN_FACES: Final = 400_000
"""Contacts, and face pairs behind them, that one detector draws at most: 10 MB and a second or two. Glass at rest on a
bench touches it for minutes in hundreds of faces. Beyond this, frames in which nothing begins, ends or is missed are
strided, and a curve may lag behind its body by the stride."""


@dataclass(frozen=True, eq=False)
class Contacts:
    """Contacts of one detection that are drawn, sorted by frame.

    ``frames`` (F,) get a row, increasing; a frame without contact clears what stood before. ``frame`` and ``pair`` (E,)
    are of each contact, as ``point`` (E, 3) in world metres; ``counts`` (E,) says how many ``segments`` (S, 2, 3)
    belong to each.
    """

    frames: NDArray[np.int64]
    frame: NDArray[np.int64]
    pair: NDArray[np.int64]
    point: FloatArray
    segments: FloatArray
    counts: NDArray[np.int64]


COLOURED: Final = (Outcome.MISSED, Outcome.INVENTED, Outcome.WITHIN_TOLERANCE)
"""Outcomes with a colour of their own; all other contacts have that of what is found."""


def contacts_path(label: str) -> str:
    """Entity of the contacts of one detector."""
    return entity("world", "contacts", label)


def log_contacts(
    writer: RecordingWriter, label: str, assembly: Assembly, detection: Detection, comparison: Comparison | None, *,
    curves: bool,
) -> None:  # fmt: skip
    """Send ``world/contacts/<label>``: points, and with ``curves`` the sections below it.

    Colours are the audit's: what ``comparison`` calls missed is red, invented yellow, the rest blue.
    """
    path = contacts_path(label)
    contacts = collect_contacts(writer.clock, assembly, detection, comparison)
    rows = np.searchsorted(contacts.frames, contacts.frame)
    per_row = np.bincount(rows, minlength=len(contacts.frames))
    colours, points = _colours(contacts, comparison), contacts.point.astype(np.float32)
    writer.rows(path, contacts.frames, rr.Points3D.columns(positions=points, colors=colours), per_row)
    writer.static(path, rr.Points3D.from_fields(radii=rr.Radius.ui_points(2.5)))
    if curves:
        per_row = np.bincount(rows, weights=contacts.counts, minlength=len(contacts.frames)).astype(np.int64)
        segments, colours = contacts.segments.astype(np.float32), np.repeat(colours, contacts.counts)
        strips = rr.LineStrips3D.columns(strips=segments, colors=colours)
        writer.rows(f"{path}/section", contacts.frames, strips, per_row)
        writer.static(f"{path}/section", rr.LineStrips3D.from_fields(radii=rr.Radius.ui_points(1.6)))


def _colours(contacts: Contacts, comparison: Comparison | None) -> NDArray[np.uint32]:
    table = packed([OUTCOMES[word][1] if word in COLOURED else FOUND for word in range(256)])
    if comparison is None:
        return np.full(len(contacts.frame), packed([FOUND])[0], dtype=np.uint32)
    return table[comparison.outcome[contacts.frame, contacts.pair]]


def collect_contacts(
    clock: RecordingClock, assembly: Assembly, detection: Detection, comparison: Comparison | None
) -> Contacts:
    """Contacts with faces in the frames that are drawn, and the rows that clear them."""
    sets = detection.face_sets
    if sets is None:
        none = np.zeros(0, dtype=np.int64)
        return Contacts(clock.kept[:1], none, none, np.zeros((0, 3)), np.zeros((0, 2, 3)), none)
    drawn = _drawn_frames(clock, sets, comparison)
    entries = np.flatnonzero(drawn[sets.frame])
    frame, pair = sets.frame[entries], sets.pair[entries]
    busy = np.zeros(len(drawn), dtype=np.bool_)
    busy[frame] = True
    frames = np.flatnonzero(drawn)
    frames = frames[busy[frames] | np.append(True, busy[frames[:-1]])]
    geometry = ContactGeometry(assembly, detection)
    point = np.zeros((len(entries), 3))
    segments = []
    for k, (t, column) in enumerate(zip(frame.tolist(), pair.tolist(), strict=True)):
        segments.append(geometry.section(t, column))
        faces = sets.faces[sets.start[entries[k]] : sets.stop[entries[k]]]
        point[k] = contact_point(segments[k]) if len(segments[k]) else geometry.centre(t, column, faces)
    counts = np.array([len(one) for one in segments], dtype=np.int64)
    joined = np.concatenate(segments) if segments else np.zeros((0, 2, 3))
    return Contacts(frames, frame, pair, point, joined, counts)


def _drawn_frames(clock: RecordingClock, sets: FaceSets, comparison: Comparison | None) -> NDArray[np.bool_]:
    """Which frames get a row, (T,): all that are kept, or a stride of them, misses first."""
    frames = len(clock.ns)
    load = np.zeros(frames)
    np.add.at(load, sets.frame, np.maximum(1.0 / DRAWN_CONTACTS, (sets.stop - sets.start) / DRAWN_FACES))
    kept = np.zeros(frames, dtype=np.bool_)
    kept[clock.kept] = True
    wanted = np.zeros(frames, dtype=np.bool_)
    if comparison is not None:
        for word in (Outcome.MISSED, Outcome.INVENTED):
            wanted |= (comparison.outcome == word).any(axis=1)
    return _strided(kept & wanted, load) | _strided(kept, load)


def _strided(frames: NDArray[np.bool_], load: FloatArray) -> NDArray[np.bool_]:
    """Every k-th of these frames, with the k that brings their load to 1 at most."""
    stride = max(1, int(np.ceil(load[frames].sum())))
    chosen = np.zeros_like(frames)
    chosen[np.flatnonzero(frames)[::stride]] = True
    return chosen


class ContactGeometry:
    """Points and curves of the contacts of one detection, in world metres."""

    def __init__(self, assembly: Assembly, detection: Detection) -> None:
        self._assembly = assembly
        self._detection = detection
        self._has_sections = detection.section_source is not None

    def section(self, frame: int, pair: int) -> FloatArray:
        """Segments (k, 2, 3) in which the surfaces meet; k = 0 where the detector computes none."""
        if not self._has_sections:
            return np.zeros((0, 2, 3))
        segments = self._detection.section(frame, pair)
        return segments[np.isfinite(segments).all(axis=(1, 2))]

    def centre(self, frame: int, pair: int, faces: NDArray[np.integer]) -> FloatArray:
        """A place near a contact without a curve: the mean centroid of the smaller face of each face pair."""
        motion = self._assembly.motion
        places = []
        for side, body in enumerate(self._assembly.pairs[pair].tolist()):
            corners = self._assembly.bodies[body].mesh.triangles[faces[:, side]]
            places.append(place_points(corners, motion.rotations[frame, body], motion.translations[frame, body]))
        extent = [np.ptp(place, axis=1).max(axis=1) for place in places]
        smaller = np.where((extent[0] <= extent[1])[:, None, None], places[0], places[1])
        mean: FloatArray = smaller.mean(axis=(0, 1))
        return mean


def contact_point(segments: FloatArray) -> FloatArray:
    """The midpoint of a segment that is nearest to the mean of all: on the surfaces even where the curve is a ring."""
    middles = segments.mean(axis=1)
    away = middles - middles.mean(axis=0)
    nearest: FloatArray = middles[int(np.argmin((away * away).sum(axis=1)))]
    return nearest
