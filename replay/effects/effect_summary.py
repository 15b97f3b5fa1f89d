"""Plan and effects of a run in figures that JSON can hold: what ran, why, at what price, and what did not."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from replay import words
from replay.effects import CATALOGUE
from replay.effects.effect_plan import Plan
from replay.effects.effects_runner import EffectRun
from replay.effects.equivalence import Equivalence
from replay.effects.output import EffectEvent, FloatArray, Series

_RANKS: Final = {name: rank for row in CATALOGUE.values() for name, rank in row.get("results", {}).items()}
RESULT_NAMES: Final = tuple(sorted(_RANKS, key=lambda name: _RANKS[name]))
"""Names of events that an experiment is done for, or ends by, the weightiest first; from the rows of the catalogue."""

EVENT_ROWS: Final = 60
"""Events listed in summary and report; ``events.parquet`` holds them all."""


def plan_summary(planned: Plan) -> dict[str, Any]:
    """The plan: effects with reasons, pairs, bodies, topics, detectors, and what is left out."""
    pairs = {f"{a}-{b}": why for (a, b), why in planned.pair_reasons.items()}
    return {
        "effects": {kind: step.because for kind, step in planned.steps.items()},
        "pairs": None if planned.pairs is None else pairs,
        "bodies": planned.bodies,
        "topics": planned.topics,
        "detectors": planned.detectors,
        "detection": planned.detection,
        "not_run": list(planned.not_run),
    }


def effect_summary(effects: Mapping[str, EffectRun], seconds: float) -> dict[str, Any]:
    """Each effect: its share of the ``seconds`` that the run took to compute, its work, what its trigger skipped."""
    return {
        kind: {
            "about": run.spec.about,
            "because": list(run.because),
            "seconds": run.seconds,
            "fraction": run.seconds / seconds if seconds > 0.0 else 0.0,
            "frames": run.frames,
            "frames_run": run.frames_run,
            "trigger": run.spec.trigger,
            "counters": dict(sorted(run.counters.items())),
            "events": dict(Counter(event.name for event in run.events)),
            "digest": run.output.digest,
            "sources": list(run.spec.sources),
        }
        for kind, run in effects.items()
    }


def events_in_order(effects: Mapping[str, EffectRun]) -> list[tuple[str, EffectEvent]]:
    """Kind and event, in order of time, and of their words where several are at one time."""
    events = [(kind, event) for kind, run in effects.items() for event in run.events]
    return sorted(events, key=lambda row: (row[1].time, row[0], row[1].name, row[1].text))


def leading_event(effects: Mapping[str, EffectRun]) -> EffectEvent | None:
    """The weightiest result of an experiment; where nothing is one, the last event: it is what the others led to."""
    events = [event for _, event in events_in_order(effects)]
    result_events = (event for event in events if event.name in RESULT_NAMES)
    return min(result_events, key=lambda event: RESULT_NAMES.index(event.name), default=events[-1] if events else None)


@dataclass(frozen=True, eq=False)
class TitrationCurve:
    """A quantity of a vessel over what came in, with the volume at each of its end points."""

    vessel: str
    quantity: str  # ``pH``, ``redox potential``, ``pAg``, ``mol of Fe^2+ left``
    unit: str  # at its axis
    added_ml: FloatArray  # (n,)
    values: FloatArray  # (n,)
    ends_ml: Sequence[float]


def titration_curves(effects: Mapping[str, EffectRun]) -> list[TitrationCurve]:
    """Curves of every vessel into which something came.

    A redox titration has that of its potential, or of a reagent whose potential nobody knows, one of a metal that of
    its pM; the pH is drawn where acid and base have an end point, or nothing else is.
    """
    if not {"mixing", "reaction"} <= effects.keys():
        return []
    curves: list[TitrationCurve] = []
    for name, volume in effects["mixing"].series.items():
        vessel = name.removesuffix("/volume")
        if vessel != name:
            own_curves = [
                curve
                for key, series in effects["reaction"].series.items()
                if (curve := _titration_curve(effects["reaction"], vessel, key, series, volume)) is not None
            ]
            other_curves = [curve for curve in own_curves if curve.quantity != "pH"]
            curves += other_curves + [
                curve for curve in own_curves if curve not in other_curves and (curve.ends_ml or not other_curves)
            ]
    return curves


def _titration_curve(run: EffectRun, vessel: str, name: str, series: Series, volume: Series) -> TitrationCurve | None:
    """Curve of a series of a vessel; ``None``: it is of another vessel, or no quantity that a titration draws."""
    quantity = name.removeprefix(f"{vessel}/")
    if quantity == name or len(series.times) < 2:
        return None
    unit = series.unit
    if quantity == "potential":
        kind, quantity, unit = Equivalence.OXIDANT_AND_REDUCTANT, "redox potential", "V against hydrogen"
    elif quantity.endswith(" left"):
        kind, quantity = Equivalence.OXIDANT_AND_REDUCTANT, f"mol of {quantity}"
    elif unit == "pH":
        kind = Equivalence.ACID_AND_BASE
    elif quantity == unit:
        kind = Equivalence.METAL_AND_ANION
    else:
        return None
    end_times = [event.time for event in run.output.events_named("end-point") if event.bodies == (vessel,)
            and event.values["of"] == kind]  # fmt: skip
    added_volume, end_volumes = (
        np.interp(times, volume.times, volume.values) - volume.values[0] for times in (series.times, end_times)
    )
    return TitrationCurve(vessel, quantity, unit, added_volume, series.values, end_volumes.tolist())


def event_lines(effects: Mapping[str, EffectRun], most_lines: int) -> list[str]:
    """The first events, a line each, and how many more there are."""
    events = events_in_order(effects)
    lines = [f"{words.moment(event.time)}: {event.text}" for _, event in events[:most_lines]]
    return lines + ([f"and {len(events) - most_lines} more"] if len(events) > most_lines else [])
