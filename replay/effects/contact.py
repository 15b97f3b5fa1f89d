"""Every confirmed contact: one frame begins it, two clear frames end it; one that never lasts two frames is flicker."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from replay.effects.declaring import Pair
from replay.effects.inputs import EffectInputs, PairContact
from replay.effects.output import EffectEvent, EffectOutput, Findings, FloatArray, Vector, vector_of
from replay.effects.protocol import spec_of
from replay.effects.spans import steady_spans

LINE_WIDTH_RATIO: Final = 1e-3
"""A curve narrower than this share of its length is a line, and a line has no plane."""


@dataclass(frozen=True, eq=False)
class EffectContact:
    """One contact of a pair, for the effects that build on it."""

    pair: Pair
    # first, stop: first frame in contact, and the first frame clear of it (T where the recording ends before)
    first: int
    stop: int
    last: int  # last frame seen in contact: poses may be lost between it and ``stop``
    last_clear_frame: int  # last frame before ``first`` known to be clear; -1 where there is none
    point: Vector | None  # where the surfaces met in the first frame, world metres, or ``None`` without faces
    # unit vector across the curve in which they met there, either way, or ``None`` where it spans no plane
    normal: Vector | None
    flicker: bool  # no two frames that follow each other are both in contact: a bump, or a tracker's noise


def compute(inputs: EffectInputs) -> EffectOutput:
    """Events ``contact`` with begin and end, a lane per pair."""
    contacts_of_pair: dict[frozenset[str], list[EffectContact]] = {}
    findings = Findings(len(inputs))
    for pair in inputs.pairs:
        pair_contact = inputs.contact(pair)
        spans = steady_spans(pair_contact.touching, pair_contact.known, frames_in=1)
        own_touches = contacts_of_pair[frozenset(pair)] = [
            _contact_of_span(pair_contact, first, stop) for first, stop in spans
        ]
        name = f"{pair[0]}-{pair[1]}"
        findings.add_lane(name, *inputs.lane_spans([(touch.first, touch.last + 1) for touch in own_touches], "contact"))
        findings.events += [_contact_event(inputs, touch) for touch in own_touches]
    findings.events.sort(key=lambda event: (event.time, event.bodies))
    findings.ran[:] = True
    return findings.output(contacts_of_pair)


def touches_of(inputs: EffectInputs, pair: Pair, *, flickers: bool = False) -> list[EffectContact]:
    """The contacts of a pair in either order of names; those of one frame only where asked for."""
    contacts: list[EffectContact] = inputs.output("contact").data.get(frozenset(pair), [])
    return [touch for touch in contacts if flickers or not touch.flicker]


def _contact_of_span(pair_contact: PairContact, first: int, stop: int) -> EffectContact:
    clear_frames = np.flatnonzero(pair_contact.known[:first] & ~pair_contact.touching[:first])
    points = pair_contact.section(first).reshape(-1, 3)
    point = vector_of(points.mean(axis=0)) if len(points) else None
    touching = pair_contact.touching[first:stop][pair_contact.known[first:stop]]
    flicker = not (touching[1:] & touching[:-1]).any()
    last_touching = first + int(np.flatnonzero(pair_contact.touching[first:stop])[-1])
    last_clear_frame = int(clear_frames[-1]) if len(clear_frames) else -1
    return EffectContact(
        pair_contact.pair, first, stop, last_touching, last_clear_frame, point, _curve_normal(points), flicker
    )


def _curve_normal(points: FloatArray) -> Vector | None:
    """Normal of the plane that fits the curve of intersection: a fresh contact cuts a small flat loop."""
    if len(points) < 3:
        return None
    _, singular_values, principal_axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
    return vector_of(principal_axes[2]) if singular_values[1] > LINE_WIDTH_RATIO * singular_values[0] else None


def _contact_event(inputs: EffectInputs, touch: EffectContact) -> EffectEvent:
    start = float(inputs.times[touch.first])
    event_values = {"frames": touch.last + 1 - touch.first, "flicker": touch.flicker}
    message = "{} touches {}".format(*touch.pair)
    return EffectEvent(
        start, "contact", touch.pair, inputs.end(touch.last + 1), event_values, message, point=touch.point
    )


SPEC = spec_of("contact", compute)
