"""Plan and effects of a run in figures that JSON can hold: what ran, why, at what price, and what did not."""

from collections import Counter
from collections.abc import Mapping
from typing import Any, Final

from replay.effects.effect_plan import Plan
from replay.effects.effects_runner import EffectRun
from replay.effects.output import EffectEvent

EVENT_ROWS: Final = 60
"""Events listed in summary and report; ``events.parquet`` holds them all."""


def plan_summary(planned: Plan) -> dict[str, Any]:
    """The plan: effects with reasons, pairs, bodies, topics, detectors, and what is left out."""
    pairs = {f"{a}-{b}": list(why) for (a, b), why in planned.pair_reasons.items()}
    return {
        "effects": {kind: list(step.because) for kind, step in planned.steps.items()},
        "pairs": None if planned.pairs is None else pairs,
        "bodies": _lists(planned.bodies),
        "topics": _lists(planned.topics),
        "detectors": _lists(planned.detectors),
        "detection": planned.detection,
        "not_built": list(planned.not_built),
        "not_run": list(planned.not_run),
    }


def effect_summary(effects: Mapping[str, EffectRun], seconds: float) -> dict[str, Any]:
    """Each effect: its share of the ``seconds`` that the run took to compute, its work, what its trigger skipped."""
    return {
        kind: {
            "about": run.spec.about,
            "because": list(run.because),
            "seconds": run.seconds,
            "share": run.seconds / seconds if seconds > 0.0 else 0.0,
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


def happened(effects: Mapping[str, EffectRun]) -> list[tuple[str, EffectEvent]]:
    """Kind and event, in order of time."""
    found = [(kind, event) for kind, run in effects.items() for event in run.events]
    return sorted(found, key=lambda row: (row[1].time, row[0], row[1].name))


def event_list(effects: Mapping[str, EffectRun]) -> list[dict[str, Any]]:
    """The first events in order of time, in seconds of the session."""
    return [
        {"effect": kind, "name": event.name, "text": event.text, "time": event.time, "end": event.end}
        for kind, event in happened(effects)[:EVENT_ROWS]
    ]


def happened_words(effects: Mapping[str, EffectRun], most: int) -> list[str]:
    """The first events, a line each, and how many more there are."""
    found = happened(effects)
    lines = [f"{event.time:.1f} s: {event.text}" for _, event in found[:most]]
    return lines + ([f"and {len(found) - most} more"] if len(found) > most else [])


def _lists(reasons: Mapping[str, tuple[str, ...]]) -> dict[str, list[str]]:
    return {name: list(why) for name, why in reasons.items()}
