"""Contacts between frames: the earliest time of impact in every step, and the steps that stay undecided, by reason."""

from dataclasses import replace

import numpy as np

from cdcore import Verdict
from replay.effects.declaring import pairs
from replay.effects.inputs import EffectInputs, PairContact
from replay.effects.output import EffectEvent, EffectOutput, Findings, vector_of
from replay.effects.protocol import EffectSpec
from replay.effects.spans import spans_of
from replay.effects.touches import Touches, touch_of


def compute(inputs: EffectInputs) -> EffectOutput:
    """Events ``hit`` where a contact begins, with the interval of its time of impact, and ``unresolved``."""
    found = Findings(len(inputs))
    heard = {pair: inputs.contact(pair) for pair in inputs.pairs}
    for pair, answer in heard.items():
        inputs.count("intervals", len(inputs))
        spans = spans_of(answer.touching)
        found.events += [_hit(inputs, answer, first, stop) for first, stop in spans]
        found.events += _unresolved(inputs, answer)
        # A contact of an interval began after the frame before it.
        found.lane(f"{pair[0]}-{pair[1]}", *inputs.shown([(max(0, first - 1), stop) for first, stop in spans], "hit"))
    found.events.sort(key=lambda event: (event.time, event.bodies))
    touches = {
        pair: tuple(replace(touch_of(one, *span), before=span[0] - 1) for span in spans_of(one.touching))
        for pair, one in heard.items()
    }
    return found.output(Touches(touches, heard), always=True)


def _hit(inputs: EffectInputs, reported: PairContact, first: int, stop: int) -> EffectEvent:
    """The begin of a contact; where the detector gives no interval of it, the step itself bounds the impact."""
    step = (float(inputs.times[max(0, first - 1)]), float(inputs.times[first]))
    low, high = reported.detection.toi.get((first, reported.column), step)
    inputs.count("hits")
    points = reported.section(first).reshape(-1, 3)
    point = vector_of(points.mean(axis=0)) if len(points) else None
    values = {"impact_low_s": low, "impact_high_s": high, "intervals": stop - first}
    words = "{} meets {}".format(*reported.pair)
    return EffectEvent(high, "hit", reported.pair, inputs.end(stop), values, words, point=point)


def _unresolved(inputs: EffectInputs, reported: PairContact) -> list[EffectEvent]:
    rows = np.flatnonzero(reported.detection.verdict[:, reported.column] == Verdict.UNRESOLVED)
    inputs.count("unresolved", len(rows))
    return [
        EffectEvent(
            float(inputs.times[row]), "unresolved", reported.pair, None,
            {"reason": reported.detection.reasons.get((row, reported.column), "no reason given")},
            "whether {} meets {} is not decided".format(*reported.pair), "warning",
        )
        for row in rows.tolist()
    ]  # fmt: skip


SPEC = EffectSpec(
    kind="sweep",
    about="Bodies that meet between two frames.",
    compute=compute,
    fields={"between": pairs("two selectors: bodies of the first against bodies of the second")},
    detector="continuous",
    sources=("motion between frames: origins linear, rotation at constant angular velocity (stated by the detector)",),
)
