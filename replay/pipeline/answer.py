"""What a run says first of each detector: what is wrong, why, what mends it, and the one moment that shows it.

``replay.pipeline.diagnosis`` makes it.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Final

from replay import words
from replay.base.constants import BUDGET_MS, HEADSET_HZ

SESSION: Final = "SESSION"
"""Stands in a command for the recording that was replayed."""

RUN: Final = "RUN"
"""Stands in a command for the folder of the run."""

TIMES_ARE: Final = "Times of this tool on this machine, not of your engine."

BUSY: Final = 0.05
"""Share of the clock that others had; with less, the 99 % of three runs lie within 30 % of each other."""


@dataclass(frozen=True)
class KeyMoment:
    """The one moment of a detector that sentence, arrow, caption and command share."""

    kind: str  # ``miss`` or ``false``
    number: int  # of the miss or false contact
    frame: int
    later_ns: int  # nanoseconds after the frame
    seconds: float  # on the session's clock
    pair: tuple[str, str]  # names of the bodies
    metres: float | None  # between the surfaces, or of the intersection curve; ``None``: not measured

    @property
    def option(self) -> str:
        """Its option of ``replay view``: ``--false 15``."""
        return f"--{self.kind} {self.number}"


@dataclass(frozen=True)
class Fix:
    """What mends most of a detector's larger fault."""

    words: str  # what to do, and where it was measured its figures
    measured: bool  # whether the figures are those of this session
    command: str = ""  # what measures it, with ``SESSION`` or ``RUN`` in place of a path; ``""``: there is none
    setting: str = ""  # the detector whose figures these are, where it is none of the run


@dataclass(frozen=True)
class Answer:
    """What is said first of a detector."""

    label: str
    sentence: str
    why: str = ""  # ``""`` where nothing is wrong
    fix: Fix | None = None
    moment: KeyMoment | None = None

    @property
    def reasons(self) -> list[tuple[str, str, str]]:
        """``Why`` and ``Fix``, each with its words and its command; nothing where nothing is wrong."""
        rows = [("Why", self.why, "")] if self.why else []
        return rows if self.fix is None else [*rows, ("Fix", self.fix.words, self.fix.command)]

    def as_json(self) -> dict[str, Any]:
        """Plain data."""
        told = asdict(self)
        if self.moment is not None:
            told["moment"]["pair"] = list(self.moment.pair)
        return told

    @staticmethod
    def of(plain: Mapping[str, Any]) -> "Answer":
        """The answer that ``as_json`` gave."""
        moment, fix = plain["moment"], plain["fix"]
        made = KeyMoment(**moment | {"pair": tuple(moment["pair"])}) if moment else None
        return Answer(plain["label"], plain["sentence"], plain["why"], Fix(**fix) if fix else None, made)


def cost(summary: Mapping[str, Any], oracle: str) -> str:
    """What the reference takes, in the same statistic as the table; ``""``: nothing was audited."""
    if not summary["audit"]:
        return ""
    figures = summary["detectors"][oracle]
    seconds = figures["seconds"]
    mean = seconds["per_frame_mean"]
    percentage = words.share(1e3 * mean / BUDGET_MS)
    text = f"{oracle} takes {words.frame_time(mean)} a frame, {percentage} of a {HEADSET_HZ:g} Hz frame"
    if "per_frame" in seconds:
        text += f"; p99 {words.frame_time(seconds['per_frame']['p99'])}"
    how = "" if figures["live"] else " Asked of all frames at once, not frame by frame."
    return f"{text}.{how}"


def busy_words(summary: Mapping[str, Any]) -> str:
    """That other programs took the processor while detectors were timed; ``""``: they did not."""
    shares = [1.0 - figures["seconds"].get("processor_share", 1.0) for figures in summary["detectors"].values()]
    return busy_sentence(max(shares, default=0.0))


def busy_sentence(share: float) -> str:
    """That other programs had this share of the clock; ``""``: too little to matter."""
    return "" if share <= BUSY else f"The machine was busy ({words.share(share)}): run again for reliable times."
