"""Figures of several sessions as one: counts are added, and every share and interval is that of the sums."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Final

from replay.audit.wilson import share

SPREADS: Final = ("onset_error", "duration_error")
"""Errors of matched contacts do not add up from their middles; each session keeps its own."""


def pool(audits: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """Label -> figures, from the ``audit`` tables of several summaries; detectors in the order first met."""
    tables = list(audits)
    if len(tables) == 1:
        return dict(tables[0])
    labels = dict.fromkeys(label for table in tables for label in table)
    return {label: _sum([table[label] for table in tables if label in table]) for label in labels}


def _sum(values: list[Any]) -> Any:
    """One value for several: shares from their counts, tables key by key, counts added, words where they agree."""
    there = [value for value in values if value is not None]
    if not there:
        return None
    if isinstance(there[0], Mapping):
        if "low" in there[0] and "of" in there[0]:
            return share(sum(value["count"] for value in there), sum(value["of"] for value in there))
        keys = dict.fromkeys(key for value in there for key in value if key not in SPREADS)
        return {key: _sum([value.get(key) for value in there]) for key in keys}
    if isinstance(there[0], str):
        return there[0] if len(set(there)) == 1 else "; ".join(dict.fromkeys(there))
    return sum(there)
