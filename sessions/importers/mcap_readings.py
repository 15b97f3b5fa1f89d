"""Messages of a foreign MCAP file that hold no pose: their numbers become scalars, rays gaze, and text events."""

from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np

from sessions.importers.beside_poses import BesidePoses
from sessions.importers.clocks import ClockFit
from sessions.importers.finish import Imported
from sessions.importers.mcap_messages import Received
from sessions.importers.pose_table import SourceFrame
from sessions.importers.readings import number, numbers_of, part, stamp_of, text
from sessions.model.event import Event

ALONE: Final = ("data", "value")
"""A field of this name is what its topic is about: the scalar is called as the topic is."""
LARGEST_STAMP: Final = 1 << 62
TEXTS: Final = ("data", "message", "msg")


@dataclass
class _Rows:
    unit: str = ""
    logged: "array[int]" = field(default_factory=lambda: array("q"))
    stamps: "array[int]" = field(default_factory=lambda: array("q"))
    values: "array[float]" = field(default_factory=lambda: array("d"))


class Readings:
    """Numbers, rays and texts, as they come in; ``put_into`` brings their stamps onto the clock of the poses."""

    def __init__(self) -> None:
        self._scalars: dict[str, _Rows] = {}
        self._rays: dict[str, _Rows] = {}
        self._texts: list[tuple[int, int, str, str]] = []
        self._logged, self._ahead = array("d"), array("d")

    def pose(self, log_ns: int, stamp_ns: int) -> None:
        """A pose was stamped so and logged then: where the two clocks meet."""
        self._logged.append(log_ns / 1e9)
        self._ahead.append((stamp_ns - log_ns) / 1e9)

    def add(self, one: Received) -> None:
        """One message of any kind but poses."""
        topic, message = one.topic.strip("/") or "topic", one.message
        stamp = stamp_of(part(message, "timestamp")) or stamp_of(part(message, "header.stamp"))
        at = (one.log_ns, stamp)
        if max(at) > LARGEST_STAMP or min(at) < 0:
            return
        words = next((text(getattr(message, name, None)) for name in TEXTS if text(getattr(message, name, None))), "")
        if words:
            self._texts.append((*at, text(getattr(message, "name", None)) or topic, words))
            return
        ray = numbers_of(part(message, "origin"), "xyz") + numbers_of(part(message, "direction"), "xyz")
        if np.isfinite(ray).all():
            _put(self._rays, topic, "", at, ray)
            return
        found = {name: value for name in _names(message) if np.isfinite(value := number(getattr(message, name, None)))}
        for name, value in found.items():
            alone = name in ALONE and len(found) == 1
            _put(self._scalars, topic if alone else f"{topic}/{name}", text(part(message, "unit")), at, [value])

    def put_into(self, samples: Imported, frame: SourceFrame) -> Imported:
        """What was read, with these beside it; what bears no stamp is brought onto the clock of the poses."""
        beside = BesidePoses()
        fit = ClockFit.of(self._logged, self._ahead) if self._logged else ClockFit(0, 0.0, 0.0, 0.0, 0.0)
        unstamped = [not all(rows.stamps) for rows in (*self._scalars.values(), *self._rays.values())]
        if (any(unstamped) or not all(stamp for _, stamp, *_ in self._texts)) and fit.readings:
            beside.notes.append(f"what bears no stamp: log times moved onto the clock of the poses by {fit.words}")
        for name, rows in self._scalars.items():
            beside.scalar(name, _stamps(rows, fit), np.array(rows.values), rows.unit)
        for name, rows in self._rays.items():
            rays = frame.axes.points(np.array(rows.values).reshape(-1, 2, 3))
            beside.looked(name, _stamps(rows, fit), rays[:, 0], rays[:, 1], np.ones(len(rays), dtype=np.bool_))
        texts = _Rows("", array("q", [row[0] for row in self._texts]), array("q", [row[1] for row in self._texts]))
        at = _stamps(texts, fit).tolist()
        events = [Event(time, name, said) for time, (_, _, name, said) in zip(at, self._texts, strict=True)]
        return replace(beside.put_into(samples, stated=False), events=sorted(events, key=lambda event: event.time_ns))


def _put(rows_of: dict[str, _Rows], name: str, unit: str, at: tuple[int, int], values: list[float]) -> None:
    rows = rows_of.setdefault(name, _Rows(unit))
    rows.logged.append(at[0])
    rows.stamps.append(at[1])
    rows.values.extend(values)


def _stamps(rows: _Rows, fit: ClockFit) -> Any:
    logged, stamps = np.array(rows.logged, dtype=np.int64), np.array(rows.stamps, dtype=np.int64)
    moved = logged + np.rint(fit.ahead(logged / 1e9) * 1e9).astype(np.int64)
    return np.where(stamps == 0, moved, stamps)


def _names(message: Any) -> Iterator[str]:
    """The fields of a decoded message, whoever decoded it."""
    described = getattr(message, "DESCRIPTOR", None)
    if described is not None:
        yield from described.fields_by_name
    else:
        yield from getattr(message, "__slots__", None) or vars(message)
