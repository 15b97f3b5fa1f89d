"""The answer about a detector: what is wrong, why, what mends it, and the one moment that shows it."""

from dataclasses import dataclass
from typing import Annotated, Literal

from msgspec import Meta, Struct

from replay.auditing.record import Count
from replay.auditing.wilson import Proportion


@dataclass(frozen=True)
class Reason:
    """A heading of the answer, with its texts in the order in which people need them.

    Parameters
    ----------
    heading : ``What``, ``When``, ``Why``, ``Do``, ``Cost``, ``Sure``, ``Also`` or ``Or``; the first three are about
        the same fault, ``Also`` is about faults of the other category.
    text : the answer itself, one short sentence.
    figures : the sentences below it; ``""``: none.
    command : to be copied; ``""``: none.
    details : what a page folds and a terminal prints with ``-v``; ``""``: nothing.
    """

    heading: str
    text: str
    figures: str = ""
    command: str = ""
    details: str = ""


class KeyMoment(Struct, frozen=True):
    """The one moment of a detector that sentence, arrow, caption and command share.

    Parameters
    ----------
    kind : ``miss`` or ``false``, as its option is called.
    number : of the miss or false contact.
    frame : the frame to look at.
    later_ns : nanoseconds after that frame.
    seconds : on the session's clock.
    pair : names of the bodies.
    metres : between the surfaces, or of the intersection curve; ``None``: not measured.
    """

    kind: Literal["miss", "false"]
    number: Annotated[int, Meta(ge=1)]
    frame: Count
    later_ns: Count
    seconds: float
    pair: tuple[str, str]
    metres: float | None

    @property
    def option(self) -> str:
        """Its option of ``replay view``: ``--false 15``."""
        return f"--{self.kind} {self.number}"


class FixFigures(Struct, frozen=True):
    """Faults and times of a Fix that was measured: what the row of a ranking holds.

    Parameters
    ----------
    what : what it is, in words.
    missed, late_or_cut_short : of the contacts; means over the sampling offsets.
    time_missed : of the pair-frames in contact, those that it does not report.
    false : of the pair-frames that it reports, those that are no contact.
    missed_counts, late_counts : smallest and largest number of contacts over the sampling offsets.
    offsets : sampling offsets that were counted; 1: there are none.
    mean : seconds a frame; ``None``: not timed.
    p99 : seconds in which 99 of 100 samples were decided; ``None``: not timed one by one.
    spans : ``right``, ``missed``, ``late``, ``false`` -> seconds from start to end of each; empty: counted, not kept.
    """

    what: str
    missed: Proportion
    late_or_cut_short: Proportion
    time_missed: Proportion
    false: Proportion
    missed_counts: tuple[Count, Count]
    late_counts: tuple[Count, Count]
    offsets: int
    mean: float | None
    p99: float | None
    spans: dict[str, tuple[tuple[float, float], ...]] = {}


class Fix(Struct, frozen=True):
    """The change of settings that removes most of a detector's larger fault.

    Parameters
    ----------
    text : what to do, in a sentence.
    measured : whether that was measured on this session.
    command : measures it, with ``SESSION`` or ``RUN`` in place of a path; ``""``: there is none.
    setting : the detector that was measured, as ``replay run --detectors`` takes it; ``""``: it is in the run.
    figures : those that were measured; ``None``: not measured, or in the ranking of the run.
    detector : label of the detector of the run that mends it; ``""``: none of the run does.
    change : where it was measured, what becomes better and what becomes worse; else ``""``.
    notes : how it was measured and what else was tried; ``""``: nothing to add.
    """

    text: str
    measured: bool
    command: str = ""
    setting: str = ""
    figures: FixFigures | None = None
    detector: str = ""
    change: str = ""
    notes: str = ""


class Answer(Struct, frozen=True):
    """The first sentences about a detector; ``when`` and ``why`` are ``""`` where nothing is wrong.

    Parameters
    ----------
    label : of the detector.
    sentence : its larger fault.
    why : the cause of the fault at the moment.
    fix : what removes that cause; ``None``: nothing is wrong.
    moment : that shows it; ``None``: nothing is wrong, or contacts were left undecided.
    what : the fault at the moment.
    when : the time and the bodies of that moment.
    other_times : when the other faults of these bodies happened.
    other_causes : the cause of the faults of the other category; ``""``: there are none.
    """

    label: str
    sentence: str
    why: str = ""
    fix: Fix | None = None
    moment: KeyMoment | None = None
    what: str = ""
    when: str = ""
    other_times: str = ""
    other_causes: str = ""

    @property
    def reasons(self) -> list[Reason]:
        """``What``, ``When``, ``Why``, ``Fix`` and ``Also``, those that there are; nothing where nothing is wrong."""
        all_reasons = [
            Reason("What", self.what),
            Reason("When", self.when, self.other_times),
            Reason("Why", self.why),
        ]
        if self.fix is not None:
            all_reasons.append(Reason("Fix", self.fix.text, self.fix.change, self.fix.command, self.fix.notes))
        all_reasons.append(Reason("Also", self.other_causes))
        return [row for row in all_reasons if row.text]
