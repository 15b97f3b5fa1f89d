"""The answer about a detector: what is wrong, why, what mends it, and the one moment that shows it."""

from typing import Annotated, Literal

from msgspec import Meta, Struct

from replay.auditing.record import Count

Reason = tuple[str, str, str]
"""A heading of the answer, its text and the command that goes with it; ``""``: none."""


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


class Fix(Struct, frozen=True):
    """The change of settings that removes most of a detector's larger fault.

    Parameters
    ----------
    text : what to do, and where it was measured what becomes better.
    measured : whether that was measured on this session.
    command : measures it, with ``SESSION`` or ``RUN`` in place of a path; ``""``: there is none.
    setting : the detector that was measured, as ``replay run --detectors`` takes it; ``""``: it is in the run.
    worse : what becomes worse, as a sentence; ``""``: nothing, or it was not measured.
    """

    text: str
    measured: bool
    command: str = ""
    setting: str = ""
    worse: str = ""


class Answer(Struct, frozen=True):
    """The first sentences about a detector; ``when`` and ``why`` are ``""`` where nothing is wrong."""

    label: str
    sentence: str
    why: str = ""
    fix: Fix | None = None
    moment: KeyMoment | None = None
    when: str = ""

    @property
    def reasons(self) -> list[Reason]:
        """``When``, ``Why``, ``Fix``, ``But``: each with text and command; nothing where nothing is wrong."""
        rows = [("When", self.when, ""), ("Why", self.why, "")]
        if self.fix is not None:
            rows.append(("Fix", self.fix.text, self.fix.command))
            if self.fix.worse:
                rows.append(("But", self.fix.worse, ""))
        return [row for row in rows if row[1]]
