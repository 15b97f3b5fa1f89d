"""The tab *Details*: of each detector one moment, its lanes pair by pair, its times by stage and its counters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from replay.comparison.outcome import Outcome
from replay.outputs.moments import KINDS, FocusMoment
from replay.outputs.palette import MISSED
from replay.outputs.rerun_log.answer import log_list
from replay.outputs.rerun_log.close_up import CloseUp, labels_of, log_cages, measure, standing_at, with_solids
from replay.outputs.rerun_log.columns import RecordingWriter, entity, steps_of
from replay.outputs.rerun_log.contacts import section_of
from replay.outputs.rerun_log.stage import log_eyes, log_labels, log_lines, log_notes, log_standing
from replay.outputs.rerun_log.texts import detector_text
from replay.pipeline.run_result import RunResult

DRAWN: Final = 60
"""Moments of one detector that are drawn at most, those that last longest; the list holds all."""


def details_path(label: str, *parts: str) -> str:
    """Entity of a part of one detector's details."""
    return entity("details", label, *parts)


def worked_moment(result: RunResult, own: Sequence[FocusMoment]) -> FocusMoment:
    """The moment to begin with: that of the sentences about the detector, else the one that lasts longest."""
    keys = {(one.label, one.moment.kind, one.moment.number) for one in result.answers if one.moment is not None}
    return max(own, key=lambda one: ((one.label, KINDS[one.outcome], one.number) in keys, one.last - one.first))


def log_details(writer: RecordingWriter, result: RunResult, label: str, views: Mapping[FocusMoment, CloseUp]) -> None:
    """Send the details of one detector; ``views``: of all moments of the run in order of time."""
    writer.markdown(details_path(label, "text"), detector_text(result, label))
    own = [one for one in views if one.label == label]
    if not own:
        return
    log_list(writer, details_path(label, "moments"), result, own)
    worked = worked_moment(result, own)
    longest = sorted(own, key=lambda one: one.first - one.last)[:DRAWN]
    drawn = sorted({worked, *longest}, key=lambda one: (one.frame, one.later))
    rows = [(one.frame, one.later, min(one.first, one.frame), one.last, one) for one in drawn]
    steps = steps_of(rows, len(writer.clock.ns), worked)
    log_notes(writer, details_path(label, "note"), steps, {one: one.said for one in drawn})
    bodies = details_path(label, "bodies")
    log_standing(
        writer, bodies, result.session.scene, steps, {one: standing_at(result, one, views[one]) for one in drawn}
    )
    log_eyes(writer, details_path(label, "eye"), [(frame, later, views[one].eye) for frame, later, one in steps])
    root = details_path(label, "close_up")
    log_labels(writer, root, steps, {one: labels_of(result, one, views[one]) for one in drawn})
    lines = {one: measure(views[one]) for one in drawn}
    oracle = result.detections[result.oracle]
    for one in drawn:
        if one.outcome == Outcome.MISSED and not one.later:
            lines[one] = [(strip, MISSED) for strip in section_of(oracle, one.frame, one.pair)]
    log_lines(writer, f"{root}/lines", steps, lines, 1.8)
    if label in with_solids(result):
        log_cages(writer, result, label, {one: views[one] for one in drawn}, steps, bodies)
