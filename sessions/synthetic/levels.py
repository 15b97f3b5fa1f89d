"""Episodes from a formula asked at three levels: as it is, and by how much meshes and noise may shift it either way."""

from __future__ import annotations

from collections.abc import Callable

from sessions.synthetic.truth import Episode, Interval, Pair

Level = Callable[[float], list[Interval]]
"""Metres -> intervals in which two surfaces are at most this far apart (negative: at least that deep)."""


def levelled(
    pair: Pair, kind: str, level: Level, blur: float, tessellation: float, clock: tuple[float, float]
) -> list[Episode]:
    """Episodes of a pair from its intervals at three levels.

    Parameters
    ----------
    blur : metres by which rounding and noise may move the surfaces either way.
    tessellation : metres by which the meshes may be farther apart than the smooth shapes.
    clock : (how much later than it happened a pose is recorded, length of the session) in seconds.
    """
    near = blur + (tessellation if kind == "contained" else 0.0)
    deep = blur + (tessellation if kind == "contact" else 0.0)
    possibly, nominal, surely = (_shifted(level(height), clock) for height in (near, 0.0, -deep))
    episodes: list[Episode] = []
    for outer in possibly:
        within = [span for span in nominal if outer[0] <= span[0] and span[1] <= outer[1]]
        if not within:
            episodes.append(Episode(pair, kind, None, None, outer))
        for span in within:
            sure = next((inner for inner in surely if span[0] <= inner[0] and inner[1] <= span[1]), None)
            episodes.append(Episode(pair, kind, span, sure, outer))
    return episodes


def _shifted(spans: list[Interval], clock: tuple[float, float]) -> list[Interval]:
    latency, seconds = clock
    late = [(start + latency if start > 0.0 else 0.0, min(end + latency, seconds)) for start, end in spans]
    return [span for span in late if span[0] <= seconds]
