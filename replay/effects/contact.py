"""Contact with hysteresis: two frames of contact begin one, two clear frames end it, and flicker makes no events."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from replay.effects.declaring import Pair, pairs
from replay.effects.inputs import EffectInputs, PairContact
from replay.effects.output import FACE_PAIRS, EffectEvent, EffectOutput, Findings, FloatArray, Series, Vector, vector_of
from replay.effects.protocol import EffectSpec
from replay.effects.spans import spans_of, steadied

FLAT: Final = 1e-3
"""A curve narrower than this share of its length is a line, and a line has no plane."""


@dataclass(frozen=True, eq=False)
class EffectContact:
    """One contact of a pair, for the effects that build on it."""

    pair: Pair  # names as declared
    # first, stop: first frame in contact, and the first frame clear of it (T where the recording ends before)
    first: int
    stop: int
    before: int  # last frame before ``first`` known to be clear; -1 where there is none
    point: Vector | None  # where the surfaces met in the first frame, world metres, or ``None`` without faces
    # unit vector across the curve in which they met there, either way, or ``None`` where it spans no plane
    normal: Vector | None


@dataclass(frozen=True, eq=False)
class Touches:
    """All contacts, hysteresis applied: pair -> touches in order of time, and pair -> what the detector said."""

    by_pair: Mapping[Pair, tuple[EffectContact, ...]]
    reported: Mapping[Pair, PairContact]

    def of(self, pair: Pair) -> tuple[EffectContact, ...]:
        """The contacts of a pair in either order of names."""
        return self.by_pair.get(pair) or self.by_pair.get((pair[1], pair[0]), ())

    def meeting(self, pair: Pair, frame: int) -> FloatArray:
        """Points (n, 3), world metres, of the curve in which a pair meets at a frame; none without faces."""
        reported = self.reported.get(pair) or self.reported[pair[1], pair[0]]
        return reported.section(frame).reshape(-1, 3)


def compute(inputs: EffectInputs) -> EffectOutput:
    """Events ``contact`` with begin and end, a lane and a count of face pairs per pair."""
    touches: dict[Pair, tuple[EffectContact, ...]] = {}
    heard: dict[Pair, PairContact] = {}
    collected = Findings(len(inputs))
    for pair in inputs.pairs:
        reported = heard[pair] = inputs.contact(pair)
        inputs.count("pair-frames", len(inputs))
        touches[pair] = tuple(
            _touch(reported, first, stop) for first, stop in steadied(reported.touching, reported.known)
        )
        inputs.count("flickers", len(spans_of(reported.touching)) - len(touches[pair]))
        if touches[pair] and reported.detection.face_sets is not None:
            collected.series[f"{pair[0]}-{pair[1]}/face_pairs"] = _faces(inputs, reported)
        spans = [(one.first, one.stop) for one in touches[pair]]
        collected.lane(f"{pair[0]}-{pair[1]}", *inputs.shown(spans, "contact"))
    found = sorted((one for many in touches.values() for one in many), key=lambda one: (one.first, one.pair))
    collected.events = [_event(inputs, one) for one in found]
    return collected.output(Touches(touches, heard), always=True)


def _touch(reported: PairContact, first: int, stop: int) -> EffectContact:
    clear = np.flatnonzero(reported.known[:first] & ~reported.touching[:first])
    points = reported.section(first).reshape(-1, 3)
    point = vector_of(points.mean(axis=0)) if len(points) else None
    return EffectContact(reported.pair, first, stop, int(clear[-1]) if len(clear) else -1, point, _normal(points))


def _normal(points: FloatArray) -> Vector | None:
    """Normal of the plane that fits the curve of intersection: a fresh contact cuts a small flat loop."""
    if len(points) < 3:
        return None
    _, size, axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
    return vector_of(axes[2]) if size[1] > FLAT * size[0] else None


def _event(inputs: EffectInputs, touch: EffectContact) -> EffectEvent:
    start, values = float(inputs.times[touch.first]), {"frames": touch.stop - touch.first}
    return EffectEvent(start, "contact", touch.pair, inputs.end(touch.stop), values, point=touch.point)


def _faces(inputs: EffectInputs, reported: PairContact) -> Series:
    """Face pairs on both sides of every change of their number, so that a line through them has no slopes."""
    counts: NDArray[np.float64] = reported.detection.face_counts[:, reported.column].astype(np.float64)
    changes = np.flatnonzero(np.diff(counts, prepend=-1.0))
    rows = np.unique(np.concatenate([changes, np.maximum(changes - 1, 0)]))
    return Series(inputs.times[rows], counts[rows], FACE_PAIRS)


SPEC = EffectSpec(
    kind="contact",
    about="Surfaces of two bodies meet.",
    compute=compute,
    fields={"between": pairs("two selectors: bodies of the first against bodies of the second")},
    detector="exact",
    sources=("hysteresis of two frames: rest of a VIVE tracker, 0.14-0.77 mm from frame to frame (own measurement)",),
)
