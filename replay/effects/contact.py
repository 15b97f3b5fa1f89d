"""Every confirmed contact: one frame begins it, two clear frames end it; one that never lasts two frames is flicker."""

import numpy as np
from numpy.typing import NDArray

from replay.effects.declaring import Pair, pairs
from replay.effects.inputs import EffectInputs, PairContact
from replay.effects.output import FACE_PAIRS, EffectEvent, EffectOutput, Findings, Series
from replay.effects.protocol import EffectSpec
from replay.effects.spans import steadied
from replay.effects.touches import EffectContact, Touches, touch_of


def compute(inputs: EffectInputs) -> EffectOutput:
    """Events ``contact`` with begin and end, a lane and a count of face pairs per pair."""
    touches: dict[Pair, tuple[EffectContact, ...]] = {}
    heard: dict[Pair, PairContact] = {}
    collected = Findings(len(inputs))
    for pair in inputs.pairs:
        reported = heard[pair] = inputs.contact(pair)
        inputs.count("pair-frames", len(inputs))
        touches[pair] = tuple(
            touch_of(reported, first, stop) for first, stop in steadied(reported.touching, reported.known, frames_in=1)
        )
        inputs.count("flickers", sum(one.flicker for one in touches[pair]))
        if touches[pair] and reported.detection.face_sets is not None:
            collected.series[f"{pair[0]}-{pair[1]}/face_pairs"] = _faces(inputs, reported)
        spans = [(one.first, one.last + 1) for one in touches[pair]]
        collected.lane(f"{pair[0]}-{pair[1]}", *inputs.shown(spans, "contact"))
    found = sorted((one for many in touches.values() for one in many), key=lambda one: (one.first, one.pair))
    collected.events = [_event(inputs, one) for one in found]
    return collected.output(Touches(touches, heard), always=True)


def _event(inputs: EffectInputs, touch: EffectContact) -> EffectEvent:
    start = float(inputs.times[touch.first])
    values = {"frames": touch.last + 1 - touch.first, "flicker": touch.flicker}
    words = "{} touches {}".format(*touch.pair)
    return EffectEvent(start, "contact", touch.pair, inputs.end(touch.last + 1), values, words, point=touch.point)


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
    sources=("two clear frames end it: rest of a VIVE tracker, 0.14-0.77 mm from frame to frame (own measurement)",),
)
