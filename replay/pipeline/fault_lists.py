"""Misses and false contacts as plain data, as many as the report has cards for; the tables of the run hold them all."""

from typing import Any, Final

import numpy as np

from replay.comparison.causes import Cause
from replay.comparison.clusters import MANY, Cluster, clusters, seen_and_between
from replay.comparison.false_contacts import HELD, FalseContact
from replay.comparison.outcome import Miss
from replay.pipeline.run_result import Measured

MOST_CARDS: Final = 1000
"""Misses of a detector with a card of their own, some 700 kB of page, and as many that no frame shows."""

LISTED: Final = 200
"""Moments of one detector of each kind at most in the picture: the longest cuts, the longest false contacts."""

BETWEEN_LOOKS: Final = (Cause.BETWEEN_LOOKS, HELD)
"""Causes that a look at every frame mends."""


def fault_list(result: Measured, label: str, right: float) -> dict[str, list[dict[str, Any]]]:
    """A row per card of a detector, seconds and metres; null: not measured. ``right``: the oracle's seconds a frame."""
    seen, between = seen_and_between(result.misses[label])
    false = sorted(result.false.get(label, ()), key=lambda one: -one.frames)
    many = len(result.misses[label]) > MANY
    rows: dict[str, list[dict[str, Any]]] = {
        "misses": [_miss(result, one) for one in (*seen[:MOST_CARDS], *between[:MOST_CARDS])],
        "clusters": [_cluster(one) for one in clusters(result.misses[label])] if many else [],
        "false": [
            _common(one) | {"at": one.start, "gap": None if np.isnan(one.gap) else one.gap} for one in false[:LISTED]
        ],
    }
    for row in (*rows["misses"], *rows["false"]):
        row["cost"] = cost_of_mending(result, label, row["cause"], right)
    return rows


def cost_of_mending(result: Measured, label: str, cause: str, right: float) -> float:
    """Seconds a frame: of the detector itself where it only looks too seldom, else of the oracle, ``right``."""
    return result.at_every_frame.get(label, right) if cause in BETWEEN_LOOKS else right


def _common(one: Miss | FalseContact) -> dict[str, Any]:
    names = ("number", "body_a", "body_b", "start", "end", "frames", "kind", "cause")
    return {name: getattr(one, name) for name in names}


def _cluster(found: Cluster) -> dict[str, Any]:
    """Misses of a pair close together in time: the ``number`` is that of the longest cut."""
    longest, (start, end) = found.deepest, found.span
    sizes = {"misses": len(found.misses), "frames": found.frames, "start": start, "end": end}
    names = {"number": longest.number, "body_a": longest.body_a, "body_b": longest.body_b, "causes": found.causes}
    return names | sizes | {"cut_length": longest.cut_length}


def _miss(result: Measured, one: Miss) -> dict[str, Any]:
    touch = one.touch
    there = None if touch is None else {"after_frame": touch.frame, "free": touch.free, "faces": list(touch.faces)}
    shown = one.seconds if touch else float(result.assembly.motion.times[one.deepest])
    sizes = {"cut_length": one.cut_length, "face_pairs": one.face_pairs, "touch": there}
    return _common(one) | {"at": one.seconds, "shown_at": shown, **sizes}
