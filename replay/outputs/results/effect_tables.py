"""Effects as tables: events beside those that were recorded, and every series in float64, one row per value."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any, Final

import numpy as np
import pyarrow as pa

from replay.effects.output import plain_value
from replay.pipeline.run_result import RunResult

EFFECT: Final = "effect/"
"""``source`` of an event that an effect found: this and its kind."""

EventRow = tuple[int, int | None, str, str, str, str, str, str]
"""stamp_ns, end_stamp_ns, source, name, body, level, message, values as JSON."""


def effect_event_rows(result: RunResult, zero: int) -> Iterator[EventRow]:
    """A row per event of every effect; ``zero`` is the stamp of second 0."""
    for kind, run in result.effects.items():
        for event in run.events:
            end = None if event.end is None else zero + round(event.end * 1e9)
            values: dict[str, Any] = dict(event.values)
            if event.point is not None:
                values["point"] = list(event.point)
            text = json.dumps(values, sort_keys=True, default=plain_value)
            yield (
                zero + round(event.time * 1e9), end, EFFECT + kind, event.name, " ".join(event.bodies), event.level,
                event.text, text,
            )  # fmt: skip


def series_table(result: RunResult) -> pa.Table:
    """Every value of every series: ``effect series unit time value``."""
    parts = [(kind, name, one) for kind, run in result.effects.items() for name, one in run.series.items()]
    counts = [len(one.times) for _, _, one in parts]
    words = {"effect": [kind for kind, _, _ in parts], "series": [name for _, name, _ in parts]}
    words["unit"] = [one.unit for _, _, one in parts]
    columns = {name: _repeated(column, counts) for name, column in words.items()}
    for name, some in {"time": "times", "value": "values"}.items():
        values = [np.zeros(0), *(getattr(one, some) for _, _, one in parts)]
        columns[name] = pa.array(np.concatenate(values), pa.float64())
    return pa.table(columns)


def _repeated(words: list[str], counts: list[int]) -> pa.DictionaryArray:
    rows = np.repeat(np.arange(len(words), dtype=np.int32), counts)
    return pa.DictionaryArray.from_arrays(pa.array(rows, pa.int32()), pa.array(words, pa.string()))
