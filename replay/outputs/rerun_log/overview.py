"""All detectors on one screen: a lane each for the pair in focus and for all pairs, the moments, and the close-up.

Rerun runs no code of ours at a click. So what is in focus is data over time: a click on a moment moves the cursor, and
lanes, close-up, solids and words there are those of the moment's pair.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass, fields, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import rerun as rr

from cdcore.protocol import counts_as_contact
from replay.comparison.outcome import Outcome
from replay.effects.output import vector_of
from replay.outputs.camera import CLOSE_UP, Eye, Obstacles, towards_user
from replay.outputs.moments import KINDS, FocusMoment, focus_rows, leading, moment_line, pair_in_focus
from replay.outputs.palette import FAINT, OUTCOMES, WITHIN_TOLERANCE
from replay.outputs.rerun_log.columns import RecordingWriter, entity, packed
from replay.outputs.rerun_log.focus import log_eyes, read_static
from replay.outputs.rerun_log.lanes import log_lane, log_with_numbers, send_lane, session_lanes, word_changes
from replay.pipeline.run_result import RunResult

ROOT: Final = "focus"
SPACE: Final = "world/focus"
EYE: Final = f"{SPACE}/eye"
ON_POLES: Final = ("pins", "flag", "pole")
"""What points at faults in the room; a close-up needs none of it."""
MOMENTS: Final = f"{ROOT}/moments"
NOTE: Final = f"{ROOT}/note"
ANSWER: Final = "answer"
TABLE: Final = f"{SPACE}/table"

CONTACT: Final = ": contact"

LINGER: Final = 0.6
"""Seconds a flag stands after its fault: nobody sees a flash of 54 ms. Faces and curves never linger."""

POLE: Final = np.array([0.0, 0.075, 0.0], dtype=np.float32)
"""Metres from a contact up to its words: a label hangs below its point and would cover the contact."""

COUNTED: Final = 500
"""Misses, those of the longest cuts, whose close-up is chosen by counting crossings: five milliseconds each."""

LANES: Final = 4
"""Lanes at most: as many as a screen of 800 lines shows, the oracle's among them."""

BACK: Final = 0.30
"""Metres from the eye to a false contact: the whole solid is seen, not the place where nothing is."""


@dataclass(frozen=True)
class OverviewLanes:
    """Paths of the lanes of the pair in focus, and of those of all pairs; the oracle's first, then the worst.

    ``doing``: lanes of what people did, where there is room for any.
    """

    near: Sequence[str]
    whole: Sequence[str]
    doing: Sequence[str] = ()


SHOWN: Final = (Outcome.MISSED, Outcome.INVENTED, Outcome.BOTH)
"""Outcomes of a lane of all pairs: of several at a time the first is shown."""

LOOKS: Final = [OUTCOMES[code] for code in SHOWN]
TRUE: Final = WITHIN_TOLERANCE
"""Grey: what is true is nobody's merit and nobody's fault."""


def overview_lanes(result: RunResult, order: Sequence[str]) -> OverviewLanes:
    """Lanes of the oracle and of the first detectors of this order."""
    labels = [result.oracle, *order][:LANES]
    near, whole = (
        [entity(ROOT, part, f"{rank}_{label}") for rank, label in enumerate(labels, 1)] for part in ("pair", "all")
    )
    return OverviewLanes(near, whole, [*session_lanes(result)][: LANES - len(labels)])


def log_moments(
    writer: RecordingWriter, result: RunResult, paths: tuple[str, str, str], moments: Mapping[FocusMoment, Eye]
) -> None:
    """Send list, words, flags and camera; ``moments`` in order of time, one at least, and the eye of each.

    ``paths`` are those of the list, of the words, and of what stands in the room.
    """
    listed, note, space = paths
    names = [result.assembly.pair_name(one.pair) for one in moments]
    widths = max(len(one.label) for one in moments), max(map(len, names))
    texts = [moment_line(one, name, widths) for one, name in zip(moments, names, strict=True)]
    colours, levels = packed(one.colour for one in moments), [KINDS[one.outcome] for one in moments]
    columns = rr.TextLog.columns(text=texts, level=levels, color=colours)
    writer.rows_later(listed, [(one.frame, one.later) for one in moments], columns)
    rows = focus_rows([*moments])
    kinds = [rr.MediaType.MARKDOWN] * len(rows)
    notes = rr.TextDocument.columns(text=[one.said for *_, one in rows], media_type=kinds)
    writer.rows_later(note, [(frame, later) for frame, later, _ in rows], notes)
    _log_flags(writer, result, space, rows)
    log_eyes(writer, f"{space}/eye", [(frame, later) for frame, later, _ in rows], [*moments.values()])


def log_overview_lanes(
    writer: RecordingWriter, result: RunResult, order: Sequence[str], moments: Sequence[FocusMoment]
) -> None:
    """Send the lanes of the pair in focus, and of all pairs."""
    lanes, assembly = overview_lanes(result, order), result.assembly
    frames = np.arange(len(assembly.motion))
    pair = pair_in_focus(moments, len(frames))
    verdict = result.detections[result.oracle].verdict
    columns, number = np.unique(pair, return_inverse=True)
    names = [assembly.pair_name(column) for column in columns.tolist()]
    texts = np.array([[name, f"{name}{CONTACT}"] for name in names], dtype=object)
    words = texts[number, counts_as_contact(verdict[frames, pair]).astype(np.intp)]
    looks = [look for free, met in texts.tolist() for look in ((free, FAINT), (met, TRUE))]
    send_lane(writer, lanes.near[0], *word_changes(writer, words), looks)
    touched = np.zeros(len(frames), dtype=np.bool_)
    for said, outcome in zip(verdict.T, next(iter(result.comparisons.values())).outcome.T, strict=True):
        touched |= counts_as_contact(said) & (outcome != Outcome.HELD)
    anywhere = np.array(["", "contact"], dtype=object)[touched.astype(np.intp)]
    send_lane(writer, lanes.whole[0], *word_changes(writer, anywhere), [("contact", TRUE)])
    for label, near, whole in zip(order, lanes.near[1:], lanes.whole[1:], strict=False):
        outcome = result.comparisons[label].outcome
        log_lane(writer, near, outcome[frames, pair], OUTCOMES)
        worst = np.full(len(frames), "", dtype=object)
        for code in reversed(SHOWN):
            worst[(outcome == code).any(axis=1)] = OUTCOMES[code][0]
        log_with_numbers(writer, whole, worst, LOOKS, result.misses[label])


def _log_flags(
    writer: RecordingWriter, result: RunResult, space: str, rows: Sequence[tuple[int, int, FocusMoment]]
) -> None:
    """A dot at all times where somebody is wrong, and words on a pole while the fault in focus lasts."""
    wrong = [one for *_, one in rows if one.label]
    dots = np.array([one.point for one in wrong], dtype=np.float32).reshape(-1, 3)
    colours = packed(one.colour for one in wrong)
    writer.static(f"{space}/pins", rr.Points3D(dots, colors=colours, radii=rr.Radius.ui_points(4.0)))
    shown: dict[int, list[FocusMoment]] = {0: []}
    last = len(writer.clock.ns) - 1
    for (frame, _, one), after in zip(rows, [*(frame for frame, *_ in rows[1:]), last], strict=True):
        begin = max(frame, min(one.first, one.frame))
        end = min(after, writer.clock.frame_at(float(result.assembly.motion.times[one.last]) + LINGER))
        if one.label and begin < max(end, one.last + 1):
            shown[begin] = [one]
            shown.setdefault(max(end, begin + 1), [])
    frames = sorted(frame for frame in shown if frame <= last)
    flat = [one for frame in frames for one in shown[frame]]
    counts = [len(shown[frame]) for frame in frames]
    feet = np.array([one.point for one in flat], dtype=np.float32).reshape(-1, 3)
    tops = feet + POLE
    colours, labels = packed(one.colour for one in flat), [f"{one.label}: {one.words}" for one in flat]
    writer.rows(f"{space}/flag", frames, rr.Points3D.columns(positions=tops, labels=labels, colors=colours), counts)
    poles = rr.LineStrips3D.columns(strips=np.stack([feet, tops], axis=1), colors=colours)
    writer.rows(f"{space}/pole", frames, poles, counts)
    radius = rr.Radius.ui_points(1.4)
    writer.static(f"{space}/flag", rr.Points3D.from_fields(radii=radius, show_labels=True))
    writer.static(f"{space}/pole", rr.LineStrips3D.from_fields(radii=radius))


def moment_eyes(result: RunResult, moments: Sequence[FocusMoment]) -> tuple[dict[FocusMoment, Eye], set[str]]:
    """An eye for each moment, and the bodies that stand between any of them and what it looks at.

    It stands before the contact that was missed; farther off where there is none, so that the bodies are seen.
    """
    assembly, scene = result.assembly, result.session.scene
    obstacles, unseen = Obstacles(assembly, scene), Obstacles(replace(assembly, bodies=()), scene)
    missed = sorted((one for one in moments if one.outcome == Outcome.MISSED), key=lambda one: -one.size)
    beyond, hiding = {*missed[COUNTED:]}, set[int]()
    eyes: dict[FocusMoment, Eye] = {}
    for one in moments:
        user = towards_user(assembly, scene, one.frame, one.point)
        eyes[one] = eye = (unseen if one in beyond else obstacles).close_up(one.frame, one.point, user)
        if one.outcome != Outcome.MISSED:
            back = np.subtract(eye.position, eye.target) * (BACK / CLOSE_UP)
            eyes[one] = eye = Eye(vector_of(np.asarray(eye.target) + back), eye.target)
        if one not in beyond:
            hiding |= obstacles.hiding(one.frame, eye)
    return eyes, {assembly.names[body] for body in hiding}


@dataclass(frozen=True)
class MomentPlace:
    """Where the cursor meets a moment; ``kind``: "miss", "false" or "contact"; ``leads``: of all it comes first."""

    label: str
    kind: str
    number: int
    session_ns: int
    leads: bool


MOMENT_COLUMNS: Final = tuple(one.name for one in fields(MomentPlace))


def moment_places(writer: RecordingWriter, result: RunResult, moments: Sequence[FocusMoment]) -> list[MomentPlace]:
    """The moments in the order of their detectors."""
    lead, order = leading(result, moments), [*result.comparisons, ""]
    places = [
        MomentPlace(one.label, KINDS[one.outcome], one.number, int(writer.clock.ns[one.frame]) + one.later, k == lead)
        for k, one in enumerate(moments)
    ]
    return sorted(places, key=lambda one: order.index(one.label))


def log_moment_table(writer: RecordingWriter, places: Sequence[MomentPlace]) -> None:
    """Send where ``replay view`` and a shared page lead."""
    rows = zip(*map(astuple, places), strict=True)
    columns: dict[str, Any] = {name: list(values) for name, values in zip(MOMENT_COLUMNS, rows, strict=True)}
    for name, kind in (("number", np.int64), ("leads", np.bool_), ("session_ns", np.int64)):
        columns[name] = np.array(columns[name], dtype=kind)
    writer.static(TABLE, rr.AnyValues(**columns))


def read_moments(recording: Path) -> list[MomentPlace]:
    """The moments, as a recording has them; none in one without an audit."""
    columns = read_static(recording, TABLE)
    return [MomentPlace(*row) for row in zip(*(columns.get(name, []) for name in MOMENT_COLUMNS), strict=True)]
