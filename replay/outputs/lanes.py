"""What the lanes of page and picture have in common: which pairs have one, and where the numbers of misses stand."""

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from replay.comparison.outcome import Comparison, Miss, Outcome

LABEL_BASE: Final = 0.011
LABEL_DIGIT: Final = 0.0055
"""A number's box is at least this share of the session wide, plus this much per digit: legible on 1,300 pixels."""


def ranked_pairs(comparison: Comparison, held: NDArray[np.bool_]) -> list[int]:
    """Columns worth a lane, worst first: most missed frames, then most invented, then most in contact; held ones last.

    A pair that was never in contact, for either detector, has none.
    """
    every = comparison.by_pair.T
    counts = every[[Outcome.MISSED, Outcome.INVENTED, Outcome.BOTH]]
    rest = every[[Outcome.WITHIN_TOLERANCE, Outcome.BETWEEN_FRAMES, Outcome.HELD]].sum(axis=0)
    order = np.lexsort((-rest, -counts[2], -counts[1], -counts[0], held))
    return [int(column) for column in order if counts[:, column].any() or rest[column]]


def number_boxes(
    misses: Sequence[Miss], session_ns: int, base: float = LABEL_BASE, digit: float = LABEL_DIGIT
) -> list[tuple[str, int, int]]:
    """Boxes ``(label, start, end)`` in nanoseconds that never overlap and are wide enough for their labels.

    ``base`` and ``digit`` are shares of ``session_ns`` that a box takes, and each character in it.
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
