"""Two runs of one session in one recording: the room once, what each of them met, and lanes of what differs.

Bodies are those of the first run; contacts and red faces are copied from both, under names of their own, so that one
cursor moves both close-ups.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final
from uuid import uuid4

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from rerun.chunk import Chunk, RrdReader

from cdcore.numerics import FloatArray
from replay.outputs.camera import Eye
from replay.outputs.lanes import number_boxes
from replay.outputs.palette import FOUND, SERIES, Rgba
from replay.outputs.rerun_log.columns import SESSION, RecordingWriter, entity, packed
from replay.outputs.rerun_log.focus import eye_columns, log_lens
from replay.outputs.rerun_log.lanes import send_rows, send_spans
from replay.outputs.rerun_log.overview import SPACE, MomentPlace, log_moment_table
from replay.outputs.rerun_log.recording_file import recording_file
from replay.outputs.rerun_log.views import seconds_between, spatial, state_view, text_list, text_view, whole_layout
from replay.outputs.rerun_log.world import body_path

if TYPE_CHECKING:
    from replay.studies.diff.diff_words import Change

ROOT: Final = "diff"
SIDES: Final = ("before", "after")
SHIFTED: Final = "shifted"
COLOURS: Final[Mapping[str, Rgba]] = {"gained": SERIES[2], "lost": SERIES[1], SHIFTED: SERIES[3]}
"""Kind of a change -> its colour; none is the red of a miss."""

BACK: Final = 0.25
"""Metres from the eye of a close-up to its change."""

WIDE: Final = 0.9
"""Metres from the eye on the whole room to the middle of all changes, at least."""

NO_HEADSET: Final = (0.3, 0.5, 0.8)
"""Where the eye stands from a change, in a session without a headset."""

HEADSET: Final = "headset"


@dataclass(frozen=True)
class DiffedDetector:
    """One detector of both runs: what changed, and the rows of its contacts in the first and in the second."""

    label: str
    changes: Sequence[Change]
    before: Sequence[Mapping[str, Any]]
    after: Sequence[Mapping[str, Any]]

    def root(self, part: str) -> str:
        """Entity of its lanes, of its list, or of its eye."""
        return entity(ROOT, self.label, part)


def write_diff_recording(
    path: Path, recordings: tuple[Path, Path], names: tuple[str, str], session: Mapping[str, Any],
    detectors: Sequence[DiffedDetector], words: str,
) -> None:  # fmt: skip
    """Write the picture; ``session``: of the summary of a run; ``words``: Markdown, its first line the title."""
    bodies = list(session["bodies"])
    copies = [_copies(one, bodies, side) for one, side in zip(recordings, SIDES, strict=True)]
    world = World(copies[0], bodies)
    points = {one.label: [world.place(change) for change in one.changes] for one in detectors}
    layout = _layout(names, session, detectors, copies, _overview([p for some in points.values() for p, _ in some]))
    with recording_file(f"vrlab-replay-diff-{uuid4().hex}", path, layout) as stream:
        for copied in copies:
            stream.send_chunks([chunk for chunks in copied.values() for chunk in chunks])
        writer = RecordingWriter(stream, None)  # type: ignore[arg-type]  # all its rows are on the session timeline
        writer.markdown(f"{ROOT}/words", words)
        for one in detectors:
            _log_lanes(writer, one, session)
            _log_changes(writer, one, points[one.label])
        _log_table(writer, detectors)


def _copies(recording: Path, bodies: Sequence[str], side: str) -> dict[str, list[Chunk]]:
    """Entity -> its chunks: contacts and red faces of a run, of the first run the bodies too."""
    found: dict[str, list[Chunk]] = {}
    roots = [f"/{body_path(name)}" for name in bodies]
    for chunk in RrdReader(recording).stream().filter(content="/world/**").to_chunks():
        place = _place(str(chunk.entity_path), roots, side)
        if place:
            found.setdefault(place, []).append(chunk.with_entity_path(place))
    return found


def _place(path: str, roots: Collection[str], side: str) -> str:
    """Where an entity of a run stands in the recording of both; ``""``: nowhere."""
    above, _, last = path.rpartition("/")
    if path in roots or path == "/world" or (above in roots and last == "mesh"):
        return path if side == SIDES[0] else ""
    if above in roots and last.startswith("missed_faces"):
        return f"{above}/{side}_{last}"
    contacts, parts = "/world/contacts", path.split("/")
    if path.startswith(f"{contacts}/") and (len(parts) == 4 or last == "section"):
        return f"{contacts}/{side}/{'/'.join(parts[3:])}"
    return ""


class World:
    """Where bodies and contacts of the first run are at a time."""

    def __init__(self, copied: Mapping[str, Sequence[Chunk]], bodies: Sequence[str]) -> None:
        self._bodies = {
            name: _rows(copied.get(f"/{body_path(name)}", ()), "Transform3D:translation") for name in bodies
        }
        contacts = [path for path in copied if path.startswith("/world/contacts/") and path.count("/") == 4]
        self._contacts = [_rows(copied[path], "Points3D:positions") for path in contacts]

    def place(self, change: Change) -> tuple[FloatArray, Eye]:
        """The point of a change, at its begin, and an eye that looks at it from the user's side."""
        ns = round(change.start * 1e9)
        ends = [self._at(self._bodies[name], ns) for name in (change.body_a, change.body_b)]
        middle = np.mean([one[0] for one in ends if len(one)] or [np.zeros(3)], axis=0)
        met = np.concatenate([np.zeros((0, 3)), *(self._at(one, ns) for one in self._contacts)])
        # A contact lies nearer to the middle of its own bodies than any other does.
        point = met[np.linalg.norm(met - middle, axis=1).argmin()] if len(met) else middle
        user = self._at(self._bodies.get(HEADSET, ([], [])), ns)
        away = user[0] - point if len(user) else np.array(NO_HEADSET)
        eye = point + BACK * away / max(float(np.linalg.norm(away)), 1e-9)
        return point, Eye(tuple(eye.tolist()), tuple(point.tolist()))

    @staticmethod
    def _at(rows: tuple[Sequence[int], Sequence[FloatArray]], ns: int) -> FloatArray:
        """The points (n, 3) of the latest row."""
        row = int(np.searchsorted(rows[0], ns, side="right")) - 1
        return rows[1][row] if row >= 0 else np.zeros((0, 3))


def _rows(chunks: Sequence[Chunk], name: str) -> tuple[list[int], list[FloatArray]]:
    """Nanoseconds, in order, and the points (n, 3) of a component from then on."""
    found: list[tuple[int, FloatArray]] = []
    for batch in (chunk.to_record_batch() for chunk in chunks):
        if name in batch.schema.names and SESSION in batch.schema.names:
            stamps = batch.column(SESSION).cast("int64").to_pylist()
            values = batch.column(name).to_pylist()
            found += [(ns, np.array(one or [], float).reshape(-1, 3)) for ns, one in zip(stamps, values, strict=True)]
    found.sort(key=lambda one: one[0])
    return [ns for ns, _ in found], [points for _, points in found]


def _log_lanes(writer: RecordingWriter, one: DiffedDetector, session: Mapping[str, Any]) -> None:
    """What each run reports, then the numbers of what was gained, lost and shifted."""
    step = float(session["median_step"])
    for rank, (side, rows) in enumerate(zip(SIDES, (one.before, one.after), strict=True), 1):
        depth: dict[int, int] = {}
        for row in rows:
            for at, by in ((row["start"], 1), (row["end"] + step, -1)):
                depth[round(at * 1e9)] = depth.get(round(at * 1e9), 0) + by
        there = np.cumsum([depth[ns] for ns in sorted(depth)]) > 0
        states = {ns: "contact" if now else "" for ns, now in zip(sorted(depth), there.tolist(), strict=True)}
        send_rows(writer, f"{one.root('lanes')}/{rank}_{side}", states, [("contact", FOUND)])
    for rank, (kind, colour) in enumerate(COLOURS.items(), 3):
        mine = [change for change in one.changes if change.kind == kind]
        boxes = number_boxes(mine, round(session["duration"] * 1e9))
        looks = [(label, colour) for label, *_ in boxes]
        send_spans(writer, f"{one.root('lanes')}/{rank}_{kind}", boxes, looks)


def _log_changes(writer: RecordingWriter, one: DiffedDetector, places: Sequence[tuple[FloatArray, Eye]]) -> None:
    """A line and an eye for each change, at its begin, and a dot with its number at all times."""
    if not one.changes:
        writer.session_rows(one.root("list"), np.zeros(1, np.int64), rr.TextLog.columns(text=["nothing changed"]))
        return
    stamps = np.array(_stamps(one.changes), dtype=np.int64)
    colours = packed(COLOURS[change.kind] for change in one.changes)
    texts = [f"{change.number:>3}  {change.words}" for change in one.changes]
    levels = [change.kind for change in one.changes]
    writer.session_rows(one.root("list"), stamps, rr.TextLog.columns(text=texts, level=levels, color=colours))
    writer.session_rows(f"world/{one.root('eye')}", stamps, eye_columns([eye for _, eye in places]))
    log_lens(writer, f"world/{one.root('eye')}")
    points = np.array([point for point, _ in places], dtype=np.float32)
    labels = [f"{change.number} {change.kind}" for change in one.changes]
    dots = rr.Points3D(
        points, colors=colours, radii=rr.Radius.ui_points(4.0), labels=labels, show_labels=len(points) < 8
    )
    writer.static(f"world/{one.root('pins')}", dots)


def _stamps(found: Sequence[Change]) -> list[int]:
    """Nanoseconds of the changes; of those that begin together each later one by one nanosecond more."""
    stamps: list[int] = []
    for change in found:
        stamps.append(max(round(change.start * 1e9), stamps[-1] + 1 if stamps else 0))
    return stamps


def _log_table(writer: RecordingWriter, detectors: Sequence[DiffedDetector]) -> None:
    """Where `replay view` opens it: at the first contact that the detector that changed most gained or lost."""
    if detectors and (found := detectors[0].changes):
        first = next((k for k, one in enumerate(found) if one.kind != SHIFTED), 0)
        leading = MomentPlace(detectors[0].label, "change", first + 1, _stamps(found)[first], True)
        log_moment_table(writer, [leading])


def _overview(points: Sequence[FloatArray]) -> Eye:
    middle = np.mean(points, axis=0) if points else np.zeros(3)
    reach = max([WIDE, *(2.0 * float(np.linalg.norm(point - middle)) for point in points)])
    eye = middle + reach * np.array(NO_HEADSET) / np.linalg.norm(NO_HEADSET)
    return Eye(tuple(eye.tolist()), tuple(middle.tolist()))


def _layout(
    names: tuple[str, str], session: Mapping[str, Any], detectors: Sequence[DiffedDetector],
    copies: Sequence[Mapping[str, Any]], eye: Eye,
) -> rrb.Blueprint:  # fmt: skip
    """A tab per detector: words, both close-ups, the lanes, the list and the room."""
    own = [[path for path in copied if f"/{side}" in path] for copied, side in zip(copies, SIDES, strict=True)]
    whole, tabs = seconds_between(0.0, float(session["duration"])), []
    for one in detectors:
        # A view follows an eye only that it shows itself.
        hidden = [f"- /{SPACE}/**", *(f"- /world/{each.root('pins')}" for each in detectors)]
        track = f"world/{one.root('eye')}" if one.changes else eye
        pictures = [
            spatial(f"{side.capitalize()}: {name}", ["/world/**", *hidden, *(f"- {path}" for path in other)], track)
            for side, name, other in zip(SIDES, names, own[::-1], strict=True)
        ]
        faces = [f"- {path}" for paths in own for path in paths]
        room = ["/world/**", *faces, f"- /world/{ROOT}/**", f"/world/{one.root('pins')}"]
        title = "When    blue: contact    green: gained    orange: lost    violet: shifted"
        lanes = [f"{one.root('lanes')}/{k}_{part}" for k, part in enumerate((*SIDES, *COLOURS), 1)]
        rows = [
            rrb.Horizontal(text_view(f"{ROOT}/words", "What changed"), *pictures, column_shares=[0.34, 0.33, 0.33]),
            state_view(one.root("lanes"), title, whole, lanes),
            rrb.Horizontal(
                text_list(one.root("list"), f"Changes of {one.label}: click the time"),
                spatial("Where", room, eye),
                column_shares=[0.6, 0.4],
            ),
        ]
        tabs.append(rrb.Vertical(*rows, row_shares=[0.36, 0.375, 0.265], name=one.label))
    return whole_layout(tabs)
