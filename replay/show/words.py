"""The words that terminal, page and picture use for the same thing, once."""

from collections.abc import Iterable, Mapping
from typing import Final

from replay.auditing.outcome import Outcome

OUTCOME_LABELS: Final[Mapping[int, str]] = {
    Outcome.BOTH: "both",
    Outcome.MISSED: "MISSED",
    Outcome.FALSE_CONTACT: "false",
    Outcome.WITHIN_TOLERANCE: "within tolerance",
    Outcome.BETWEEN_FRAMES: "between frames",
    Outcome.LEFT_OUT: "left out",
    Outcome.GRASPED: "held",
}
"""Outcome of an audit -> its word. They are true positive, false negative, false positive and the four that count as
neither; NEITHER, the true negative, has no word: it is a gap in a lane."""

PAIR_FRAME_ROWS: Final[Mapping[str, str]] = {
    "both": OUTCOME_LABELS[Outcome.BOTH].lower(),
    "missed": OUTCOME_LABELS[Outcome.MISSED].lower(),
    "false_contact": OUTCOME_LABELS[Outcome.FALSE_CONTACT].lower(),
    "within_tolerance": OUTCOME_LABELS[Outcome.WITHIN_TOLERANCE].lower(),
    "left_out": OUTCOME_LABELS[Outcome.LEFT_OUT].lower(),
}
"""Field of ``PairFrames`` -> its name in tables, in their order."""


WITHIN_TOLERANCE_LABEL: Final = OUTCOME_LABELS[Outcome.WITHIN_TOLERANCE]

NOT_COMPUTED: Final = "Contacts were not computed: no effect of the scene needs them"

NOTHING_SUSPICIOUS: Final = "Nothing suspicious found"
"""What is said of a recording without warning or error: not that it can be trusted, for not every fault shows."""

LANE_LEGEND: Final[Mapping[int, str]] = {
    Outcome.MISSED: "red: missed",
    Outcome.FALSE_CONTACT: "yellow: false",
    Outcome.BOTH: "blue: both",
    Outcome.GRASPED: "green: held",
    Outcome.BETWEEN_FRAMES: "violet: between frames",
    Outcome.WITHIN_TOLERANCE: "grey: within tolerance",
    Outcome.LEFT_OUT: "dark: left out",
}
"""What the colours of audit lanes mean, the worst first."""


PINK_LEGEND: Final = "pink: late or cut short"
"""The colour of frames missed at the beginning, the end or in the midst of a contact that is reported."""

LANES_LEGEND: Final = (
    f"blue: right   yellow: false contact   red: missed   {PINK_LEGEND}   grey: reference   white line: cursor"
)
"""What the colours of lanes of all pairs mean."""


def lane_legend(outcomes: Iterable[int], missing_detector: str = "", *, has_late: bool = False) -> str:
    """The colours of the outcomes there are; ``missing_detector``: who missed.

    ``has_late``: some are missed in a part.
    """
    present_outcomes = set(outcomes)
    labels = [
        f"{text} by {missing_detector}" if missing_detector and outcome == Outcome.MISSED else text
        for outcome, text in LANE_LEGEND.items()
        if outcome in present_outcomes
    ]
    if has_late:
        labels.insert(1, PINK_LEGEND)
    return "    ".join(labels)
