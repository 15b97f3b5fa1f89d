"""Sentences about the time of a run."""

from typing import Final

from replay import words
from replay.document.run_document import RunDocument
from sessions.model.constants import HEADSET_HZ

BUDGET_MS: Final = 1000.0 / HEADSET_HZ
"""Milliseconds of a frame of the headset: the time in which a live loop does everything."""

TIMES_SENTENCE: Final = "Times are this tool's, not your engine's."

BATCH_TIMING_SENTENCE: Final = "Timed on all frames at once, not frame by frame."

NO_SLOWEST_SENTENCE: Final = "The slowest frames were not measured."

BUSY_FRACTION: Final = 0.05
"""Share of the clock that others had; with less, the 99 % of three runs lie within 30 % of each other."""


FRAME_TEXT: Final = f"a {HEADSET_HZ:g} Hz frame"


def cost_sentence(document: RunDocument) -> str:
    """Return the time of the reference, in the same statistic as the table; ``""``: nothing was audited."""
    if not document.audit:
        return ""
    detector = document.detectors[document.oracle]
    seconds = detector.seconds
    percentage = words.as_percentage(1e3 * seconds.per_frame_mean / BUDGET_MS)
    text = f"{document.oracle} takes {words.frame_time(seconds.per_frame_mean)} a frame, {percentage} of {FRAME_TEXT}"
    # By the clock the slowest frames of a busy machine are those in which other programs ran.
    has_p99 = seconds.p99 is not None and not busy_text(document)
    p99_clause = f"; 99 % of frames within {words.frame_time(seconds.p99)}" if has_p99 else ""
    return f"{text}{p99_clause}.{'' if detector.live else f' {BATCH_TIMING_SENTENCE}'}"


def busy_text(document: RunDocument) -> str:
    """That other programs took the processor while detectors were timed; ``""``: they did not."""
    fractions = [detector.seconds.processor_fraction for detector in document.detectors.values()]
    return busy_sentence(max((1.0 - fraction for fraction in fractions if fraction is not None), default=0.0))


def busy_sentence(fraction: float) -> str:
    """That other programs had this fraction of the clock; ``""``: too little to matter."""
    return (
        ""
        if fraction <= BUSY_FRACTION
        else f"The machine was busy ({words.as_percentage(fraction)}): run again for reliable times."
    )
