"""The lists of moments, and in the room what points at the moment nearest to the cursor.

Rerun runs no code of ours at a click. So what is in focus is data over time: a click on a moment moves the cursor, and
close-up and solids there are those of that moment.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Final

import numpy as np
import rerun as rr

from replay.comparison.outcome import Outcome
from replay.outputs.moments import KINDS, FocusMoment, focus_rows, leading, moment_line
from replay.outputs.palette import FREE, Rgba, albedo, tags_of
from replay.outputs.rerun_log.close_up import CloseUp, labels_of, log_cages, measure, with_solids
from replay.outputs.rerun_log.columns import RecordingWriter, Steps, entity, packed, steps_of
from replay.outputs.rerun_log.moment_table import MomentPlace, log_moment_table
from replay.outputs.rerun_log.stage import faded, log_eyes, log_labels, log_lines
from replay.outputs.rerun_log.texts import detector_text
from replay.outputs.rerun_log.world import Colours
from replay.pipeline.run_result import RunResult

SPACE: Final = "world/focus"
EYE: Final = f"{SPACE}/eye"
ON_POLES: Final = ("pins", "flag", "pole")
"""What points at faults in the room; a close-up needs none of it."""
ANSWER: Final = "answer"
MOMENTS: Final = "moments/list"

LINGER: Final = 0.6
"""Seconds a flag stands after its fault: nobody sees a flash of 54 ms. Faces and curves never linger."""

FLAGS: Final = {Outcome.MISSED: "miss", Outcome.INVENTED: "false contact"}

POLE: Final = np.array([0.0, 0.075, 0.0], dtype=np.float32)
"""Metres from a contact up to its words: a label hangs below its point and would cover the contact."""


def log_answer(writer: RecordingWriter, result: RunResult, views: Mapping[FocusMoment, CloseUp]) -> None:
    """Send the list, the close-ups, and what stands in the room; ``views``: of all moments in order of time."""
    moments = [*views]
    log_list(writer, MOMENTS, result, moments)
    log_moment_table(writer, _places(writer, result, moments))
    log_eyes(writer, EYE, [(frame, later, views[one].eye) for frame, later, one in focus_rows(moments)])
    faults = [one for one in moments if one.label]
    steps = fault_steps(writer, faults)
    log_labels(writer, SPACE, steps, {one: labels_of(result, one, views[one]) for one in faults})
    log_lines(writer, f"{SPACE}/measure", steps, {one: measure(views[one]) for one in faults}, 1.6)
    for label in with_solids(result):
        log_cages(writer, result, label, views, steps)
    _log_flags(writer, faults)


def fault_steps(writer: RecordingWriter, faults: Sequence[FocusMoment], linger: float = 0.0) -> Steps:
    """Each fault while it lasts; nothing at other times."""
    clock = writer.clock
    ends = [clock.frame_at(float(clock.ns[one.last]) * 1e-9 + linger) if linger else one.last for one in faults]
    rows = [(one.frame, one.later, min(one.first, one.frame), end, one) for one, end in zip(faults, ends, strict=True)]
    return steps_of(rows, len(clock.ns), None)


def log_list(writer: RecordingWriter, path: str, result: RunResult, moments: Sequence[FocusMoment]) -> None:
    """Send one line per moment: a click on its time moves the cursor there."""
    names = [result.assembly.pair_name(one.pair) for one in moments]
    widths = max((len(one.label) for one in moments), default=0), max(map(len, names), default=0)
    texts = [moment_line(one, name, widths) for one, name in zip(moments, names, strict=True)]
    columns = rr.TextLog.columns(
        text=texts, level=[KINDS[one.outcome] for one in moments], color=packed(one.colour for one in moments)
    )
    writer.rows_later(path, [(one.frame, one.later) for one in moments], columns)


def details_path(label: str, *parts: str) -> str:
    """Entity of a part of one detector's details."""
    return entity("details", label, *parts)


def log_details(writer: RecordingWriter, result: RunResult, label: str, moments: Iterable[FocusMoment]) -> None:
    """Send the details of one detector; ``moments``: all of the run in order of time."""
    writer.markdown(details_path(label, "text"), detector_text(result, label))
    own = [one for one in moments if one.label == label]
    if own:
        log_list(writer, details_path(label, "moments"), result, own)


def focus_colours(result: RunResult, views: Mapping[FocusMoment, CloseUp]) -> Colours:
    """White for a body that touches nothing, while it is said to; translucent what stands before a moment."""
    colours: dict[str, list[tuple[int, int, Rgba]]] = {}
    names = result.assembly.names
    usual = [albedo(tags_of(name, result.session.scene)) for name in names]
    touched = {body for view in views.values() for body in (view.free, *view.hiding) if body is not None}
    for frame, later, one in focus_rows([*views]):
        for body in touched:
            colour = usual[body]
            if body == views[one].free:
                colour = FREE
            elif body in views[one].hiding:
                colour = faded(colour, tags_of(names[body], result.session.scene))
            colours.setdefault(names[body], []).append((frame, later, colour))
    return colours


def _places(writer: RecordingWriter, result: RunResult, moments: Sequence[FocusMoment]) -> list[MomentPlace]:
    """The moments in the order of their detectors."""
    lead, order = leading(result, moments), [*result.comparisons, ""]
    places = [
        MomentPlace(one.label, KINDS[one.outcome], one.number, int(writer.clock.ns[one.frame]) + one.later, k == lead)
        for k, one in enumerate(moments)
    ]
    return sorted(places, key=lambda one: order.index(one.label))


def _log_flags(writer: RecordingWriter, faults: Sequence[FocusMoment]) -> None:
    """A dot at all times where somebody is wrong, and words on a pole while the fault in focus lasts."""
    dots = np.array([one.point for one in faults], dtype=np.float32).reshape(-1, 3)
    colours = packed(one.colour for one in faults)
    writer.static(f"{SPACE}/pins", rr.Points3D(dots, colors=colours, radii=rr.Radius.ui_points(4.0)))
    steps = fault_steps(writer, faults, LINGER)

    def flags(some: list[FocusMoment]) -> rr.ComponentColumnList:
        tops = np.array([one.point for one in some], dtype=np.float32).reshape(-1, 3) + POLE
        words = [f"{one.label}: {FLAGS[one.outcome]} {one.number}" for one in some]
        return rr.Points3D.columns(positions=tops, labels=words, colors=packed(one.colour for one in some))

    writer.steps(f"{SPACE}/flag", steps, lambda one: [one] if one else [], flags)
    radius = rr.Radius.ui_points(1.4)
    writer.static(f"{SPACE}/flag", rr.Points3D.from_fields(radii=radius, show_labels=True))
    feet = {one: np.asarray(one.point, dtype=np.float64) for one in faults}
    poles = {one: [(np.stack([foot, foot + POLE]), one.colour)] for one, foot in feet.items()}
    log_lines(writer, f"{SPACE}/pole", steps, poles, 1.4)
