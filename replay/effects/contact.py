"""Contact with hysteresis: two frames of contact begin one, two clear frames end it, and flicker makes no events."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from replay.effects.declaring import Pair, pairs
from replay.effects.inputs import EffectInputs, PairContact
from replay.effects.output import EffectEvent, EffectOutput, LaneSpan, Series, Vector
from replay.effects.protocol import EffectSpec
from replay.effects.spans import spans_of, steadied

FRAMES_IN: Final = 2
FRAMES_OUT: Final = 2
"""Frames in a row. A resting tracker steps by 0.14-0.77 mm from frame to frame, so that a contact at rest flickers."""


@dataclass(frozen=True, eq=False)
class Touch:
    """One contact of a pair, for the effects that build on it.

    Parameters
    ----------
    pair : names as declared.
    first, stop : first frame in contact, and the first frame clear of it (T where the recording ends before).
    before : last frame before ``first`` known to be clear; -1 where there is none.
    point : where the surfaces met in the first frame, world metres, or ``None`` without faces.
    """

    pair: Pair
    first: int
    stop: int
    before: int
    point: Vector | None


@dataclass(frozen=True, eq=False)
class Touches:
    """All contacts: pair -> touches in order of time, and pair -> (T,) bool in contact, hysteresis applied."""

    by_pair: dict[Pair, tuple[Touch, ...]]

    def of(self, pair: Pair) -> tuple[Touch, ...]:
        """The contacts of a pair in either order of names."""
        return self.by_pair.get(pair) or self.by_pair.get((pair[1], pair[0]), ())


def compute(inputs: EffectInputs) -> EffectOutput:
    """Events ``contact`` with begin and end, a lane and a count of face pairs per pair."""
    touches: dict[Pair, tuple[Touch, ...]] = {}
    series: dict[str, Series] = {}
    for pair in inputs.pairs:
        told = inputs.contact(pair)
        inputs.count("pair-frames", len(inputs))
        touches[pair] = tuple(
            _touch(told, first, stop) for first, stop in steadied(told.touching, told.known, FRAMES_IN, FRAMES_OUT)
        )
        inputs.count("flickers", len(spans_of(told.touching)) - len(touches[pair]))
        if touches[pair] and told.detection.face_sets is not None:
            series[f"{pair[0]}-{pair[1]}/face_pairs"] = _faces(inputs, told)
    found = sorted((one for many in touches.values() for one in many), key=lambda one: (one.first, one.pair))
    return EffectOutput(
        events=tuple(_event(inputs, one) for one in found),
        series=series,
        lanes={f"{a}-{b}": _lane(inputs, many) for (a, b), many in touches.items() if many},
        data=Touches(touches),
    )


def _touch(told: PairContact, first: int, stop: int) -> Touch:
    clear = np.flatnonzero(told.known[:first] & ~told.touching[:first])
    segments = told.section(first)
    point: Vector | None = None
    if len(segments):
        x, y, z = segments.reshape(-1, 3).mean(axis=0).tolist()
        point = (x, y, z)
    return Touch(told.pair, first, stop, int(clear[-1]) if len(clear) else -1, point)


def _event(inputs: EffectInputs, touch: Touch) -> EffectEvent:
    end = None if touch.stop >= len(inputs) else float(inputs.times[touch.stop])
    frames = touch.stop - touch.first
    return EffectEvent(
        float(inputs.times[touch.first]), "contact", touch.pair, end, {"frames": frames}, point=touch.point
    )


def _lane(inputs: EffectInputs, touches: tuple[Touch, ...]) -> tuple[LaneSpan, ...]:
    last = len(inputs) - 1
    return tuple(
        LaneSpan(float(inputs.times[one.first]), float(inputs.times[min(one.stop, last)]), "contact") for one in touches
    )


def _faces(inputs: EffectInputs, told: PairContact) -> Series:
    """Face pairs wherever their number changes."""
    counts: NDArray[np.float64] = told.detection.face_counts[:, told.column].astype(np.float64)
    rows = np.flatnonzero(np.diff(counts, prepend=-1.0))
    return Series(inputs.times[rows], counts[rows], "face pairs")


SPEC = EffectSpec(
    kind="contact",
    about="Surfaces of two bodies meet.",
    compute=compute,
    fields={"between": pairs("two selectors: bodies of the first against bodies of the second")},
    detector="exact",
    sources=("hysteresis of two frames: rest of a VIVE tracker, 0.14-0.77 mm from frame to frame (own measurement)",),
)
