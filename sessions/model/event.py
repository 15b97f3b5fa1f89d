"""Events, intervals and contacts of the live engine, in the words of their source.

The engine's contacts are audited and never used as truth.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Event:
    """A moment: a button pressed, a remark, a collision the engine reported.

    Parameters
    ----------
    time_ns : nanoseconds on the session clock.
    name : what happened, for example ``buttondown``.
    message : the words for a reader.
    body : the body it belongs to, or ``""``.
    level : ``debug``, ``info``, ``warning``, ``error`` or ``fatal``.
    """

    time_ns: int
    name: str
    message: str = ""
    body: str = ""
    level: str = "info"


@dataclass(frozen=True)
class Interval:
    """A span: a task, a learning stage, a feature of the teaching.

    Parameters
    ----------
    start_ns, end_ns : nanoseconds on the session clock, ``start_ns <= end_ns``.
    kind : ``task``, ``stage`` or ``feature``.
    name : for example ``perceptual interaction``.
    data : further facts, text to text.
    """

    start_ns: int
    end_ns: int
    kind: str
    name: str
    data: Mapping[str, str] = field(default_factory=dict)


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
