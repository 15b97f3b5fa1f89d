"""Lanes of states: one per pair in the words of the audit, silence is a gap, and no change is too narrow to keep.

A lane is sent on the session timeline only: a reset one nanosecond before each change keeps the viewer from merging
neighbours narrower than four pixels into grey, and a frame number leaves no room for it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from cdcore import Detection
from replay.assembly import Assembly
from replay.audit.outcome import Comparison, Miss, Outcome
from replay.rerun_log.colours import MISSED, MISSED_DARK, OUTCOME_WORDS, VERDICT_WORDS, Rgba, packed
from replay.rerun_log.columns import RecordingWriter, entity

Words = Mapping[int, tuple[str, Rgba]]

LABEL_BASE: Final = 0.011
LABEL_DIGIT: Final = 0.0055
"""A number's box is at least this share of the session wide, plus this much per digit: legible on 1,300 pixels."""


def ranked_pairs(comparison: Comparison, held: NDArray[np.bool_]) -> list[int]:
    """Columns worth a lane, worst first: most missed frames, then most invented, then most in contact; held ones last.

    A pair that was never in contact, for either detector, has none.
    """
    counts = np.stack(
        [(comparison.outcome == word).sum(axis=0) for word in (Outcome.MISSED, Outcome.INVENTED, Outcome.BOTH)]
    )
    rest = np.isin(comparison.outcome, (Outcome.WITHIN_TOLERANCE, Outcome.BETWEEN_FRAMES)).sum(axis=0)
    order = np.lexsort((-rest, -counts[2], -counts[1], -counts[0], held))
    return [int(column) for column in order if counts[:, column].any() or rest[column]]


def audit_lanes(root: str, assembly: Assembly, comparison: Comparison) -> dict[str, int | None]:
    """Paths of the lanes of one audit and the column each speaks of: the numbers (``None``), then pairs, worst first.

    The viewer sorts lanes by path, numbers in it as numbers.
    """
    lanes: dict[str, int | None] = {f"{root}/1_missed": None}
    for rank, column in enumerate(ranked_pairs(comparison, assembly.held), start=2):
        name = assembly.pair_name(column) + ("_held" if assembly.held[column] else "")
        lanes[entity(*root.split("/"), f"{rank}_{name}")] = column
    return lanes


def log_audit_lanes(
    writer: RecordingWriter, lanes: Mapping[str, int | None], comparison: Comparison, misses: Sequence[Miss]
) -> None:
    """Send the number lane and a lane per pair."""
    for path, column in lanes.items():
        if column is None:
            log_number_lane(writer, path, misses)
        else:
            log_lane(writer, path, comparison.outcome[:, column], OUTCOME_WORDS)


def log_detector_lanes(
    writer: RecordingWriter, root: str, assembly: Assembly, detections: Mapping[str, Detection], columns: Sequence[int]
) -> None:
    """Send ``<root>/<pair>/<detector>`` lanes in the glossary's words for these pairs."""
    for rank, column in enumerate(columns, start=1):
        for label, detection in detections.items():
            path = entity(root, f"{rank}_{assembly.pair_name(column)}", label)
            log_lane(writer, path, detection.verdict[:, column], VERDICT_WORDS)


def log_lane(writer: RecordingWriter, path: str, state: NDArray[np.uint8], words: Words) -> None:
    """Send one lane: a row where the state changes, a reset a nanosecond before it, a gap for states without a word."""
    text = np.array([words[code][0] if code in words else "" for code in range(256)], dtype=object)
    changes = np.flatnonzero(np.diff(state.astype(np.int16), prepend=-1))
    stamps, states = writer.clock.ns[changes], text[state[changes]].tolist()
    # The last state lasts one frame: left open, it would run to the end of the axis, seconds of a miss that was one.
    end = writer.clock.ns[-1:] + round(float(np.median(np.diff(writer.clock.ns)))) if len(state) > 1 else stamps[:0]
    send_lane(writer, path, np.concatenate([stamps, end]), states + [""] * len(end), [words[k] for k in words])


def log_number_lane(writer: RecordingWriter, path: str, misses: Sequence[Miss]) -> None:
    """Send the lane of the misses' numbers.

    A miss of 54 ms in a minute is one pixel wide. Its number is widened until it can be read; where numbers would
    overlap, they share a box: ``12-31``. So this lane says that and which; the pair's own lane says exactly when.
    """
    boxes = number_boxes(misses, int(writer.clock.ns[-1]) if len(writer.clock.ns) else 0)
    names = [label for label, _, _ in boxes]
    stamps = np.array([stamp for _, start, end in boxes for stamp in (start, end)], dtype=np.int64)
    states = [text for name in names for text in (name, "")]
    colours = [(name, MISSED if k % 2 else MISSED_DARK) for k, name in enumerate(names)]
    send_lane(writer, path, stamps, states, colours)


def number_boxes(
    misses: Sequence[Miss], session_ns: int, base: float = LABEL_BASE, digit: float = LABEL_DIGIT
) -> list[tuple[str, int, int]]:
    """Boxes ``(label, start, end)`` in nanoseconds that never overlap and are wide enough for their labels.

    Parameters
    ----------
    base, digit : shares of ``session_ns`` that a box takes, and each character in it.
    """
    boxes: list[tuple[str, int, int]] = []
    first = start = reach = 0
    for miss in sorted(misses, key=lambda one: (one.start, one.number)):
        begin, end = round(miss.start * 1e9), round(miss.end * 1e9)
        if boxes and begin < boxes[-1][2]:
            boxes.pop()
        else:
            first, start, reach = miss.number, begin, end
        reach = max(reach, end)
        label = str(first) if first == miss.number else f"{first}-{miss.number}"
        width = round((base + digit * len(label)) * session_ns)
        boxes.append((label, start, max(start + width, reach)))
    return boxes


def send_lane(
    writer: RecordingWriter,
    path: str,
    stamps: NDArray[np.int64],
    states: Sequence[str],
    words: Sequence[tuple[str, Rgba]],
) -> None:
    """Send states at these nanoseconds, ``""`` for none, and the colours of the words."""
    writer.static(
        path,
        rr.StateConfiguration(values=[word for word, _ in words], colors=packed(colour for _, colour in words)),
    )
    before = ["", *states[:-1]]
    resets = [k for k, state in enumerate(states) if before[k] and state]
    # A first, empty row at zero gives every lane a row wherever the cursor is; a state that begins there replaces it.
    times = np.concatenate([[0], stamps, stamps[resets] - 1]).astype(np.int64)
    texts = np.array(["", *states, *[""] * len(resets)], dtype=object)
    order = np.argsort(times, kind="stable")
    times, texts = times[order], texts[order]
    last = np.append(np.flatnonzero(np.diff(times)), len(times) - 1)
    writer.session_rows(path, times[last], rr.StateChange.columns(state=texts[last].tolist()))
