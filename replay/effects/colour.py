"""An indicator shows the pH: one colour below its range, the other above, and in between a mixture."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from typing import Final

import numpy as np

from replay.effects.declaring import Declaration
from replay.effects.inputs import EffectInputs
from replay.effects.output import COLOURS, EffectEvent, EffectOutput, Findings, FloatArray, LaneSpan, Series, blended
from replay.effects.protocol import spec_of
from replay.effects.spans import spans_of
from sessions.model.scene import Scene

WORDS: Final = ("acid_colour", "base_colour")


def compute(inputs: EffectInputs) -> EffectOutput:
    """Event ``colour-change`` from entering the range to leaving it by the other side; colour in the glass."""
    found = Findings(len(inputs))
    for declared in sorted(inputs.declared, key=lambda one: one["indicator"]):
        vessel = declared["in"]
        ph = inputs.output("reaction").series.get(f"{vessel}/pH")
        if ph is None or not len(ph.times):
            inputs.count("vessels without a pH: nothing came in, or neither acid nor base")
            continue
        low, high = declared["from_ph"], declared["to_ph"]
        share = np.clip((ph.values - low) / (high - low), 0.0, 1.0)
        found.ran |= np.isin(inputs.times, ph.times)
        found.series[f"{vessel}/{declared['indicator']}"] = Series(ph.times, share, "share")
        found.events += _changes(declared, ph.times, share)
        lane = vessel if vessel not in found.lanes else f"{vessel} {declared['indicator']}"
        found.lanes[lane] = _lane(declared, ph.times, share)
        clear = inputs.output("mixing").liquids.get(vessel)
        if clear is not None:
            acid, base = (COLOURS[declared[key]] for key in WORDS)
            held = np.maximum(0, np.searchsorted(ph.times, clear.times, side="right") - 1)
            shade = blended(acid, base, share[held])
            found.liquids[vessel] = replace(clear, rgba=shade)
    return found.output()


def _changes(declared: Declaration, times: FloatArray, share: FloatArray) -> Iterator[EffectEvent]:
    """Passages through the range: from the last row at one end to the first at the other, which may not be reached."""
    side = np.where(share <= 0.0, -1, np.where(share >= 1.0, 1, 0))
    ends = np.flatnonzero(side).tolist()
    passed: list[tuple[int, int | None]] = [
        (before, after) for before, after in pairwise(ends) if side[before] != side[after]
    ]
    if ends and ends[-1] < len(side) - 1:
        passed.append((ends[-1], None))
    for before, after in passed:
        old, new = (declared[key] for key in (WORDS if side[before] < 0 else WORDS[::-1]))
        words = f"{declared['indicator']} in {declared['in']} turns from {old} to {new}"
        end = None if after is None else float(times[after])
        yield EffectEvent(float(times[before + 1]), "colour-change", (declared["in"],), end, {"to": new}, words)


def _lane(declared: Declaration, times: FloatArray, share: FloatArray) -> list[LaneSpan]:
    acid, base = (declared[key] for key in WORDS)
    between = tuple(blended(COLOURS[acid], COLOURS[base], np.array([0.5]))[0].tolist())
    masks = (
        (share <= 0.0, acid, COLOURS[acid]), ((share > 0.0) & (share < 1.0), f"{acid} to {base}", between),
        (share >= 1.0, base, COLOURS[base]),
    )  # fmt: skip
    return [
        LaneSpan(float(times[first]), float(times[min(stop, len(times) - 1)]), word, rgba)
        for mask, word, rgba in masks
        for first, stop in spans_of(mask)
    ]


def _check(declared: Declaration, _scene: Scene) -> None:
    if not declared["from_ph"] < declared["to_ph"]:
        raise declared.fail("from_ph is not below to_ph; give the range in which the indicator changes, rising")


SPEC = spec_of("colour", compute, check=_check)
