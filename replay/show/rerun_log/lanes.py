"""Lanes of states, in the words of the audit, and of what people did. A state without a word is a gap.

No change is lost. A lane is sent on the session timeline only: a reset one nanosecond before each change keeps the
viewer from merging neighbours narrower than four pixels into grey, and a frame number leaves no room for it.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from cdcore.protocol import counts_as_contact
from replay.auditing.outcome import Comparison, Outcome, counts_by_pair
from replay.document.ranking import fix_lane
from replay.document.run_result import RunResult
from replay.show.palette import LATE_LOOK, OUTCOME_STYLES, REFERENCE, SERIES_COLOURS, VERDICT_STYLES, Rgba, fault_key
from replay.show.rerun_log.recording_file import RecordingWriter, drawable, entity, pack_colours
from replay.words import safe_text

LabelledSpan = tuple[str, int, int]
"""A word, and the first and last nanosecond on the session timeline."""

ACTIVITY_ROOT: Final = "doing"
"""Lanes stand in the order of their paths: these above those of effects and of the pair in focus."""

INTERVAL_KINDS: Final = ("stage", "task", "feature")
"""Kinds of spans, in the order of their lanes; any other follows."""

LANES_ENTITY: Final = "lanes"
COLON_LOOKALIKE: Final = "\u02d0_"
"""A letter that looks like a colon."""

MOST_PAIRS: Final = 40
"""Pairs with lanes per detector at most: beyond it nobody scrolls, and every lane costs the viewer a row."""

MOST_LANES: Final = 4
"""Lanes beside the list at most, as many as a screen of 800 lines shows, the reference's among them."""

RANKED_OUTCOMES: Final = (Outcome.MISSED, Outcome.FALSE_CONTACT, Outcome.BOTH)
"""Outcomes of a lane of all pairs: of several at a time the first is shown."""

UNRANKED_OUTCOMES: Final = (Outcome.WITHIN_TOLERANCE, Outcome.BETWEEN_FRAMES, Outcome.GRASPED)
"""Outcomes of contact that matter least for the order of lanes."""

NARROWEST_MISS_FRACTION: Final = 0.005
"""Share of the session that a miss takes in the lane of all pairs at least: one of 54 ms in a minute is one pixel wide.
The lane of its pair says exactly when."""


def lane_name(*labels: str) -> str:
    """A path that reads as words: the viewer shows the path of a lane, and escapes most of what is no letter.

    The first two words are parted by a letter that looks like a colon, for a colon is escaped.
    """
    return COLON_LOOKALIKE.join(re.sub(r"[^\w.-]+", "_", drawable(word)).strip("_") for word in labels)


def pair_lanes(result: RunResult, label: str) -> dict[str, int]:
    """Paths of the lanes of one detector, worst first, and the pair's column that each speaks of.

    The viewer sorts lanes by path. Pairs have one in which the detector or the reference sees contact.
    """
    assembly, comparison = result.assembly, result.comparisons.get(label)
    if comparison is None:
        columns = np.flatnonzero(counts_as_contact(result.detections[label].verdict).any(axis=0)).tolist()
    else:
        columns = ranked_pairs(comparison, assembly.grasped)
    lanes = {}
    for rank, column in enumerate(columns[:MOST_PAIRS], 1):
        # What was compared has a lane for a whole group, what was not one for each member.
        pair = "-".join(assembly.bodies_of(column)) if comparison is None else assembly.pair_name(column)
        name = f"{rank}_{pair}{', held' if assembly.grasped[column] else ''}"
        lanes[entity(LANES_ENTITY, label, lane_name(name))] = column
    return lanes


def ranked_pairs(comparison: Comparison, is_grasped: NDArray[np.bool_]) -> list[int]:
    """Columns worth a lane, worst first: most missed frames, then most invented, then most in contact; held ones last.

    A pair that was never in contact, for either detector, has none.
    """
    outcome_counts = counts_by_pair(comparison.by_contact, len(Outcome))
    missed_counts, false_contacts, both_counts = -outcome_counts[:, RANKED_OUTCOMES].T
    other_counts = outcome_counts[:, UNRANKED_OUTCOMES].sum(axis=1)
    pair_order = np.lexsort((-other_counts, both_counts, false_contacts, missed_counts, is_grasped))
    return [
        column
        for column in pair_order.tolist()
        if outcome_counts[column, RANKED_OUTCOMES].any() or other_counts[column]
    ]


def log_pair_lanes(writer: RecordingWriter, result: RunResult, label: str) -> None:
    """Send what a detector made of each pair, or, where nothing was compared, what it said."""
    comparison = result.comparisons.get(label)
    verdicts, style_of_verdict, looks = result.detections[label].verdict, VERDICT_STYLES, [*VERDICT_STYLES.values()]
    if comparison is not None:
        verdicts, style_of_verdict, looks = comparison.by_contact, OUTCOME_STYLES, [*OUTCOME_STYLES.values(), LATE_LOOK]
    labels = np.array(
        [style_of_verdict[code][0] if code in style_of_verdict else "" for code in range(256)], dtype=object
    )
    columns = result.assembly.contact_columns
    for path, column in pair_lanes(result, label).items():
        frame_texts = labels[verdicts[:, column]]
        for miss in result.misses.get(label, ()):
            if columns[miss.pair] == column and fault_key(miss.kind) == "late":
                _mark_late(frame_texts, miss.first, miss.last)
        log_lane(writer, path, spans_of(writer, frame_texts), looks, is_labelled=comparison is None)


def _mark_late(texts: NDArray[np.object_], first: int, last: int, least_frames: int = 0) -> None:
    """Set the missed frames of a contact that is reported in part to *late*, at least ``least_frames`` of them."""
    segment = texts[first : last + 1]
    segment[segment == OUTCOME_STYLES[Outcome.MISSED][0]] = LATE_LOOK[0]
    texts[first : first + least_frames] = LATE_LOOK[0]


def detector_lanes(result: RunResult, order: Sequence[str]) -> list[str]:
    """Lanes of all pairs: the reference, the first detectors of this order, and the Fix below the first one."""
    lanes = [lane_name(f"{number}_{label}") for number, label in enumerate(_labels_of_lanes(result, order), 2)]
    return [lane_name(f"1_{result.oracle}", "reference"), *lanes]


def _labels_of_lanes(result: RunResult, order: Sequence[str]) -> list[str]:
    """Labels of the lanes below that of the reference, as many as there is room for."""
    fix = fix_lane(result.ranking, result.document)
    labels = [*order[:1], *([] if fix is None else [fix[0].label]), *order[1:]]
    return labels[: MOST_LANES - 1]


def log_detector_lanes(writer: RecordingWriter, result: RunResult, order: Sequence[str], lanes: Sequence[str]) -> None:
    """Send contact of the reference in grey, and what is wrong or right anywhere."""
    verdict, outcomes = result.detections[result.oracle].verdict, result.comparisons[order[0]].outcome
    is_touched = (counts_as_contact(verdict) & (outcomes != Outcome.GRASPED)).any(axis=1)
    labels = np.where(is_touched, "contact", "").astype(object)
    log_lane(writer, lanes[0], spans_of(writer, labels), [("contact", REFERENCE)], is_labelled=False)
    lane_styles = [*(OUTCOME_STYLES[code] for code in RANKED_OUTCOMES), LATE_LOOK]
    for label, path in zip(_labels_of_lanes(result, order), lanes[1:], strict=True):
        labels = _fix_labels(result) if label not in result.comparisons else _outcome_labels(result, label)
        log_lane(writer, path, spans_of(writer, labels), lane_styles, is_labelled=False)


def _fix_labels(result: RunResult) -> NDArray[np.object_]:
    """The worst outcome of the Fix in each frame, as a word; ``""``: no contact."""
    fix, times = fix_lane(result.ranking, result.document), result.assembly.motion.times
    labels = np.full(len(times), "", dtype=object)
    assert fix is not None, "a lane was made of it"
    codes = {"right": Outcome.BOTH, "false": Outcome.FALSE_CONTACT, "late": None, "missed": Outcome.MISSED}
    for kind, code in codes.items():
        least_frames = round(NARROWEST_MISS_FRACTION * len(labels)) if kind in ("late", "missed") else 1
        for start, end in fix[1].spans[kind]:
            first, last = np.searchsorted(times, (start, end))
            labels[first : max(last, first + least_frames)] = LATE_LOOK[0] if code is None else OUTCOME_STYLES[code][0]
    return labels


def _outcome_labels(result: RunResult, label: str) -> NDArray[np.object_]:
    """The worst outcome of a detector in each frame, as a word; ``""``: no contact."""
    outcome = result.comparisons[label].outcome
    labels = np.full(len(outcome), "", dtype=object)
    for code in reversed(RANKED_OUTCOMES):
        labels[(outcome == code).any(axis=1)] = OUTCOME_STYLES[code][0]
    least_frames = round(NARROWEST_MISS_FRACTION * len(labels))
    for miss in result.misses[label]:
        if fault_key(miss.kind) == "late":
            _mark_late(labels, miss.first, miss.last, least_frames)
    for miss in result.misses[label]:
        if fault_key(miss.kind) == "missed":
            labels[miss.first : max(miss.last + 1, miss.first + least_frames)] = OUTCOME_STYLES[Outcome.MISSED][0]
    return labels


def spans_of(writer: RecordingWriter, labels: NDArray[np.object_]) -> list[LabelledSpan]:
    """Stretches of the same word in a word per frame; ``""`` is a gap."""
    ns = writer.clock.ns
    if not len(ns):
        return []
    change_frames = np.flatnonzero(np.append(True, labels[1:] != labels[:-1]))
    # The last state lasts one frame: left open, it would run on to the end of the axis.
    end_ns = int(ns[-1]) + (round(float(np.median(np.diff(ns)))) if len(ns) > 1 else 1)
    edges = [*ns[change_frames].tolist(), end_ns]
    return [span for span in zip(labels[change_frames].tolist(), edges, edges[1:], strict=False) if span[0]]


def log_lane(
    writer: RecordingWriter,
    path: str,
    spans: Sequence[LabelledSpan],
    word_colours: Iterable[tuple[str, Rgba]],
    *,
    is_labelled: bool = True,
) -> None:
    """Send a lane of spans in order of time, and the colours of their words; ``is_labelled``: they stand in bars.

    The words of an audit are those of the legend, and a short bar would cut them.
    """
    colours = dict(word_colours)
    # The viewer writes the value where a label is empty.
    labels = [word if is_labelled else " " for word in colours]
    writer.static(path, rr.StateConfiguration(values=[*colours], labels=labels, colors=pack_colours(colours.values())))
    # A first, empty row at zero gives every lane a row wherever the cursor is; a state that begins there replaces it.
    state_of_word = {0: ""}
    for word, start, end in spans:
        if start and start in state_of_word:
            state_of_word[start - 1] = ""
        state_of_word |= {start: word, end: ""}
    stamps = sorted(state_of_word)
    columns = rr.StateChange.columns(state=[state_of_word[ns] for ns in stamps])
    writer.session_rows(path, np.array(stamps, dtype=np.int64), columns)


def session_lanes(result: RunResult) -> dict[str, list[LabelledSpan]]:
    """Path -> its spans, in order of time; where spans of a kind overlap, each has a lane of its own."""
    stamps = result.assembly.stamp_ns
    if not len(stamps):
        return {}
    first_ns, last_ns = int(stamps[0]), int(stamps[-1] - stamps[0])
    lanes_of_kind: dict[str, list[list[LabelledSpan]]] = {}
    for interval in sorted(result.session.intervals, key=lambda interval: (interval.start_ns, interval.end_ns)):
        start, end = max(0, interval.start_ns - first_ns), min(last_ns, interval.end_ns - first_ns)
        if start < end:
            lane_rows = lanes_of_kind.setdefault(interval.kind, [])
            row = next((row for row in lane_rows if row[-1][2] <= start), [])
            if not row:
                lane_rows.append(row)
            row.append((safe_text(interval.name or interval.kind), start, end))
    sorted_kinds = sorted(
        lanes_of_kind,
        key=lambda kind: (INTERVAL_KINDS.index(kind) if kind in INTERVAL_KINDS else len(INTERVAL_KINDS), kind),
    )
    lanes = [(kind, row) for kind in sorted_kinds for row in lanes_of_kind[kind]]
    return {entity(ACTIVITY_ROOT, f"{number}_{kind}"): row for number, (kind, row) in enumerate(lanes, 1)}


def log_session_lanes(writer: RecordingWriter, result: RunResult) -> None:
    """Send the lanes; the same word has the same colour in all of them."""
    lanes = session_lanes(result)
    labels = dict.fromkeys(word for spans in lanes.values() for word, _, _ in spans)
    for path, spans in lanes.items():
        log_lane(writer, path, spans, in_series(labels))


def in_series(labels: Mapping[str, Any]) -> list[tuple[str, Rgba]]:
    """A colour for each word: ``labels`` maps it to its own, or to nothing."""
    return [
        (word, colour or SERIES_COLOURS[k % len(SERIES_COLOURS)]) for k, (word, colour) in enumerate(labels.items())
    ]
