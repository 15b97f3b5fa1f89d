"""Output of an effect: events, series, lanes, liquids; outputs are equal exactly when their digests are."""

import hashlib
import json
import tomllib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from importlib.resources import files
from itertools import permutations
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from cdcore.numerics import BoolArray
from cdcore.numerics import FloatArray as FloatArray

Vector = tuple[float, float, float]


def vector_of(point: FloatArray) -> Vector:
    """A place (3,) as three plain numbers."""
    return float(point[0]), float(point[1]), float(point[2])


Rgba = tuple[int, int, int, int]

_DRAWN: Final = tomllib.loads(files("replay.effects").joinpath("output.toml").read_text(encoding="utf-8"))


def blend_colours(
    first: Rgba | NDArray[np.uint8], second: Rgba | NDArray[np.uint8], fraction: FloatArray
) -> NDArray[np.uint8]:
    """(n, 4) from the first colour (share 0) to the second (share 1), each of which may be one a row."""
    weight = np.clip(fraction, 0.0, 1.0)[:, None]
    mixed_colours = (1.0 - weight) * np.array(first, dtype=np.float64) + weight * np.array(second, dtype=np.float64)
    return np.round(mixed_colours).astype(np.uint8)


COLOUR_WORDS: Final[Mapping[str, Rgba]] = {word: tuple(colour) for word, colour in _DRAWN["colours"].items()}
"""Plain colour -> red, green, blue, alpha; drawn, not measured."""

SHADES: Final[Mapping[str, tuple[str, float]]] = {word: tuple(row) for word, row in _DRAWN["shades"].items()}
"""Word before a colour -> the colour towards which it goes, and how far."""


def _mix_colours(mixtures: Mapping[str, tuple[Rgba, Rgba, float]]) -> dict[str, Rgba]:
    """Name -> the colour between two, at a fraction of the way; all at once, in a twentieth of the time."""
    first, second, fractions = (np.array(column) for column in zip(*mixtures.values(), strict=True))
    mixed = blend_colours(first, second, fractions).tolist()
    return {name: (red, green, blue, alpha) for name, (red, green, blue, alpha) in zip(mixtures, mixed, strict=True)}


def _all_colours() -> dict[str, Rgba]:
    """Plain colours, halves of two such as ``blue-green``, and the shades of both such as ``deep blue``."""
    plain = {word: rgba for word, rgba in COLOUR_WORDS.items() if " " not in word}
    halves = _mix_colours({f"{a}-{b}": (plain[a], plain[b], 0.5) for a, b in permutations(plain, 2)})
    shades = _mix_colours(
        {
            f"{shade} {word}": (rgba, plain[target], fraction)
            for shade, (target, fraction) in SHADES.items()
            for word, rgba in {**plain, **halves}.items()
        }
    )
    return {**plain, **halves, **shades, **COLOUR_WORDS}


COLOURS: Final[Mapping[str, Rgba]] = _all_colours()
"""Every colour that a scene may name -> red, green, blue, alpha."""

WATERY: Final = COLOURS["colourless"]
"""A liquid that no effect gives a colour."""

QUANTITIES: Final[Mapping[str, str]] = _DRAWN["quantities"]
"""Unit of a series -> quantity and unit, for an axis."""


@dataclass(frozen=True)
class EffectEvent:
    """Something an effect found.

    Parameters
    ----------
    time : seconds since the session's first frame; the begin of a span.
    name : one word: ``contact``, ``grasp``, ``spill``, ``end-point``, ...
    bodies : who took part, the acting one first.
    end : end of a span, seconds; ``None``: a moment, or a span that the recording does not end.
    values : numbers and words; units in the names (``volume_ml``, ``speed_m_s``).
    message : for a reader; ``""``: made from the name and the bodies.
    level : ``info``, ``warning`` or ``error``: how a person at the bench should take it.
    point : world metres: where a marker stands in the picture.
    """

    time: float
    name: str
    bodies: tuple[str, ...] = ()
    end: float | None = None
    values: Mapping[str, float | int | str | bool] = field(default_factory=dict)
    message: str = ""
    level: str = "info"
    point: Vector | None = None

    @property
    def text(self) -> str:
        """The words for a reader."""
        return self.message or f"{self.name} {' - '.join(self.bodies)}".strip()


@dataclass(frozen=True, eq=False)
class Series:
    """A quantity over time.

    Parameters
    ----------
    times : (n,) seconds, not decreasing.
    values : (n,) float64; NaN where it is not known.
    unit : ``mL``, ``pH``, ``degC``, ``m``, ...
    """

    times: FloatArray
    values: FloatArray
    unit: str = ""

    def __post_init__(self) -> None:
        if self.times.shape != self.values.shape or self.times.ndim != 1:
            raise ValueError(f"a series has times {self.times.shape} and values {self.values.shape}; give two of (n,)")


@dataclass(frozen=True)
class LaneSpan:
    """A stretch of a lane: from ``start`` to ``end`` seconds it shows ``word``; ``rgba``: its own colour."""

    start: float
    end: float
    word: str
    rgba: tuple[int, int, int, int] | None = None


@dataclass(frozen=True, eq=False)
class Liquid:
    """Liquid drawn in a vessel; a row wherever it changes.

    Parameters
    ----------
    times : (n,) seconds.
    level : (n,) metres from the body's origin along its +Y to the surface.
    floor : metres from the body's origin to the cavity's floor.
    radius : metres, of the cylinder drawn.
    rgba : (n, 4) uint8.
    """

    times: FloatArray
    level: FloatArray
    floor: float
    radius: float
    rgba: NDArray[np.uint8]

    def __post_init__(self) -> None:
        count = len(self.times)
        if self.level.shape != (count,) or self.rgba.shape != (count, 4):
            raise ValueError(f"a liquid has {count} times, level {self.level.shape}, rgba {self.rgba.shape}")


@dataclass(frozen=True, eq=False)
class EffectOutput:
    """The outcome of one effect."""

    events: tuple[EffectEvent, ...] = ()  # in order of time
    series: Mapping[str, Series] = field(default_factory=dict)  # name (``flask/volume``) -> quantity over time
    lanes: Mapping[str, tuple[LaneSpan, ...]] = field(default_factory=dict)  # name -> spans in order
    # (T,) bool, frames in which it computed; ``None``: all. The rest were skipped because its trigger was off.
    ran: BoolArray | None = None
    liquids: Mapping[str, Liquid] = field(default_factory=dict)  # body -> what stands in it
    data: Any = None  # for the effects that need this one

    def events_named(self, name: str) -> tuple[EffectEvent, ...]:
        """The events of one name."""
        return tuple(event for event in self.events if event.name == name)

    @property
    def digest(self) -> str:
        """SHA-256 of everything but ``data``."""
        digest = hashlib.sha256()
        for event in self.events:
            digest.update(json.dumps(asdict(event), sort_keys=True, default=plain_value).encode())
        for name, series in sorted(self.series.items()):
            digest.update(f"{name}/{series.unit}".encode() + series.times.tobytes() + series.values.tobytes())
        for name, spans in sorted(self.lanes.items()):
            digest.update(json.dumps([name, [asdict(span) for span in spans]]).encode())
        for name, liquid in sorted(self.liquids.items()):
            digest.update(name.encode() + np.array([liquid.floor, liquid.radius]).tobytes())
            digest.update(liquid.times.tobytes() + liquid.level.tobytes() + liquid.rgba.tobytes())
        digest.update(b"" if self.ran is None else self.ran.tobytes())
        return digest.hexdigest()


class Findings:
    """Collects the output of an effect while it runs, for frames (T,); ``output`` puts all of it in order of time."""

    def __init__(self, count: int) -> None:
        self.events: list[EffectEvent] = []
        self.series: dict[str, Series] = {}
        self.lanes: dict[str, list[LaneSpan]] = {}
        self.liquids: dict[str, Liquid] = {}
        self.ran = np.zeros(count, dtype=np.bool_)

    def add_lane(self, name: str, *spans: LaneSpan) -> None:
        """Add spans to a lane."""
        if spans:
            self.lanes.setdefault(name, []).extend(spans)

    def output(self, data: Any = None) -> EffectOutput:
        """Everything so far."""
        events = tuple(sorted(self.events, key=lambda event: event.time))
        lanes = {
            name: tuple(sorted(spans, key=lambda span: (span.start, span.word))) for name, spans in self.lanes.items()
        }
        return EffectOutput(events, self.series, lanes, self.ran, self.liquids, data)


def plain_value(value: Any) -> Any:
    """Numbers of numpy as numbers of JSON."""
    return value.tolist() if hasattr(value, "tolist") else str(value)
