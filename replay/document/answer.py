"""The answer about a detector: what is wrong, why, what mends it, and the one moment that shows it."""

from typing import Annotated, Literal

from msgspec import Meta, Struct

from replay.record import Count


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
    text : what to do, and where it was measured its metrics.
    measured : whether they were measured on this session.
    command : measures it, with ``SESSION`` or ``RUN`` in place of a path; ``""``: there is none.
    setting : the detector whose metrics these are, as ``replay run --detectors`` takes it; ``""``: it is in the run.
    """

    text: str
    measured: bool
    command: str = ""
    setting: str = ""


class Answer(Struct, frozen=True):
    """The first sentences about a detector; ``why`` is ``""`` where nothing is wrong."""

    label: str
    sentence: str
    why: str = ""
    fix: Fix | None = None
    moment: KeyMoment | None = None

    @property
    def reasons(self) -> list[tuple[str, str, str]]:
        """``Why`` and ``Fix``, each with its text and its command; nothing where nothing is wrong."""
        rows = [("Why", self.why, "")] if self.why else []
        return rows if self.fix is None else [*rows, ("Fix", self.fix.text, self.fix.command)]
