"""Lanes of states, one per pair, in the words of the audit. A state without a word is a gap; no change is lost.

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
from replay.comparison.outcome import Comparison, Miss
from replay.outputs.lanes import number_boxes, ranked_pairs
from replay.outputs.palette import MISSED, MISSED_DARK, VERDICTS, Looks, Rgba
from replay.outputs.rerun_log.columns import RecordingWriter, entity, packed
from replay.prepare.assembly import Assembly

NARROW: Final = (0.028, 0.012)
"""Shares of the session that the box of a number takes, and each digit, in a view of half a screen."""


def audit_lanes(root: str, assembly: Assembly, comparison: Comparison) -> dict[str, int | None]:
    """Paths of the lanes of one audit and the column each speaks of: the numbers (``None``), then pairs, worst first.

    The viewer sorts lanes by path, numbers in it as numbers.
    """
    lanes: dict[str, int | None] = {f"{root}/1_missed": None}
    for rank, column in enumerate(ranked_pairs(comparison, assembly.held), start=2):
        name = assembly.pair_name(column) + ("_held" if assembly.held[column] else "")
        lanes[entity(*root.split("/"), f"{rank}_{name}")] = column
    return lanes


def noise_lane(lane: str) -> str:
    """Path of the lane below that of a pair: what tracker noise leaves of its contacts."""
    return f"{lane}/in_noise"


def log_detector_lanes(
    writer: RecordingWriter, root: str, assembly: Assembly, detections: Mapping[str, Detection], columns: Sequence[int]
) -> None:
    """Send ``<root>/<pair>/<detector>`` lanes in the glossary's words for these pairs."""
    for rank, column in enumerate(columns, start=1):
        for label, detection in detections.items():
            path = entity(root, f"{rank}_{assembly.pair_name(column)}", label)
            log_lane(writer, path, detection.verdict[:, column], VERDICTS)


def log_lane(writer: RecordingWriter, path: str, state: NDArray[np.uint8], words: Looks) -> None:
    """Send one lane of states; one without a word is a gap."""
    text = np.array([words[code][0] if code in words else "" for code in range(256)], dtype=object)
    send_lane(writer, path, *word_changes(writer, text[state]), [words[k] for k in words])


def word_changes(writer: RecordingWriter, words: NDArray[np.object_]) -> tuple[NDArray[np.int64], list[str]]:
    """When a word per frame, ``""`` for none, changes, in nanoseconds, and to what."""
    changes = np.flatnonzero(np.append(True, words[1:] != words[:-1])) if len(words) else np.zeros(0, np.int64)
    # The last state lasts one frame: left open, it would run to the end of the axis, seconds of a miss that was one.
    ns = writer.clock.ns
    end = ns[-1:] + round(float(np.median(np.diff(ns)))) if len(words) > 1 else ns[:0]
    return np.concatenate([ns[changes], end]), words[changes].tolist() + [""] * len(end)


def log_with_numbers(
    writer: RecordingWriter, path: str, words: NDArray[np.object_], looks: Sequence[tuple[str, Rgba]],
    misses: Sequence[Miss],
) -> None:  # fmt: skip
    """Send a lane of a word per frame over which the numbers of misses stand, widened as in their own lane."""
    stamps, states = word_changes(writer, words)
    session_ns = int(writer.clock.ns[-1]) if len(writer.clock.ns) else 0
    boxes = number_boxes(misses, session_ns, *NARROW)
    rows = dict(zip(stamps.tolist(), states, strict=True))
    for label, start, end in boxes:
        after = [state for ns, state in sorted(rows.items()) if ns <= end]
        rows = {ns: state for ns, state in rows.items() if not start <= ns <= end}
        rows |= {start: label, end: after[-1] if after else ""}
    shades = [(label, MISSED if k % 2 else MISSED_DARK) for k, (label, _, _) in enumerate(boxes)]
    at = sorted(rows)
    send_lane(writer, path, np.array(at, dtype=np.int64), [rows[ns] for ns in at], [*looks, *shades])


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


def send_lane(
    writer: RecordingWriter, path: str, stamps: NDArray[np.int64], states: Sequence[str],
    words: Sequence[tuple[str, Rgba]],
) -> None:  # fmt: skip
    """Send states at these nanoseconds, ``""`` for none, and the colours of the words."""
    names, colours = [word for word, _ in words], packed(colour for _, colour in words)
    writer.static(path, rr.StateConfiguration(values=names, colors=colours))
    before = ["", *states[:-1]]
    resets = [k for k, state in enumerate(states) if before[k] and state]
    # A first, empty row at zero gives every lane a row wherever the cursor is; a state that begins there replaces it.
    times = np.concatenate([[0], stamps, stamps[resets] - 1]).astype(np.int64)
    texts = np.array(["", *states, *[""] * len(resets)], dtype=object)
    order = np.argsort(times, kind="stable")
    times, texts = times[order], texts[order]
    last = np.append(np.flatnonzero(np.diff(times)), len(times) - 1)
    writer.session_rows(path, times[last], rr.StateChange.columns(state=texts[last].tolist()))
