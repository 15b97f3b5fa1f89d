"""Contacts that the engine reported while the session ran; they are audited and never used as truth."""

from dataclasses import dataclass


@dataclass(frozen=True)
class LiveContact:
    """One report of the live engine.

    Parameters
    ----------
    time_ns : nanoseconds on the session clock.
    body_a, body_b : the two bodies as the engine names them.
    phase : ``enter``, ``stay`` or ``exit``.
    point : where, in metres of the world, or ``None`` when the engine did not say.
    """

    time_ns: int
    body_a: str
    body_b: str
    phase: str
    point: tuple[float, float, float] | None = None


PHASES = ("enter", "stay", "exit")
