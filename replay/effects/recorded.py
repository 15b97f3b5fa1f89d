"""Numbers that were recorded beside the poses, shown as effects are: they are there where the recording holds them."""

from time import perf_counter
from typing import Final

import numpy as np

from replay.effects.effects_runner import EffectRun
from replay.effects.output import EffectOutput, Series
from replay.effects.protocol import EffectSpec
from replay.prepare.assembly import Assembly
from sessions import Session

SCALARS: Final = "scalars"
CURVES: Final = "curves"

SPEC = EffectSpec(SCALARS, "Numbers that were recorded beside the poses.", lambda _: EffectOutput())


def recorded(session: Session, assembly: Assembly) -> dict[str, EffectRun]:
    """Kind -> the numbers between the first and the last frame of the assembly; empty where there are none."""
    start, count = perf_counter(), len(assembly.motion)
    series = {}
    for name, track in session.scalars.items() if count else ():
        times = (track.times_ns - assembly.first_ns) / 1e9
        first, last = assembly.motion.times[[0, -1]]
        rows = np.flatnonzero((times >= first) & (times <= last))
        if len(rows):
            series[name] = Series(times[rows], track.values[rows], track.unit)
    if not series:
        return {}
    output, seconds = EffectOutput(series=series), perf_counter() - start
    return {SCALARS: EffectRun(SPEC, ("it was recorded",), output, seconds, {CURVES: len(series)}, count, count)}
