"""MCAP files of other programs: poses in Foxglove's messages (protobuf or JSON), tf2 and geometry_msgs of ROS 2.

Of messages that hold no pose, numbers become scalars and texts events.

Source: Foxglove schemas, https://docs.foxglove.dev/docs/sdk/schemas; ROS 2 common_interfaces; ROS REP 103, REP 105.
"""

from array import array
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from sessions.importers.finish import Imported
from sessions.importers.frame_tree import FrameTree
from sessions.importers.joining import ClockFit
from sessions.importers.mcap_messages import Received, listed, number, numbers_of, part, received, stamp_of, text
from sessions.importers.pose_table import BesidePoses, SourceFrame, Stamps, imported
from sessions.meshes.conventions import convention as convention_named
from sessions.model.event import Event

ASSUMED: Final = "ros"
"""Axes where none are named: Foxglove and ROS both follow REP 103."""


def read_mcap(
    source: Path,
    *,
    convention: str | None = None,
    topics: Sequence[str] = (),
) -> Imported:
    """Everything in an MCAP file of another program.

    A frame is a body of its name, a pose one of its topic. Stamps are those of the messages.

    Parameters
    ----------
    convention : a name in ``CONVENTIONS``; ``None``: that of ROS.
    topics : read these alone; none: all that hold poses. Of several whose poses are in frames that no transform joins,
        the frames are taken for one world.

    Raises ``ImportFileError``: names file, topic and what to do.
    """
    axes = convention_named(convention or ASSUMED)
    tree, readings, unstamped = FrameTree(str(source)), Readings(), 0
    for one in received(source, tuple(LAYOUTS), topics):
        if one.kind:
            unstamped += _add(one, tree, readings)
        else:
            readings.add(one)
    tables, words, joined = tree.tables(join=len(topics) > 1)
    if unstamped:
        words.append(f"{unstamped} poses without a stamp have the time they were logged at")
    assumed = [] if convention else [f"axes {ASSUMED} ({axes.words})"]
    frame = SourceFrame(axes, "m", 1.0, "stamps of the messages, ns", "ns", (*assumed, "lengths in m", *joined))
    return replace(readings.put_into(imported(tables, frame, words)), of_people=False)


class _Layout(NamedTuple):
    """Where a message keeps its poses: attributes, with dots between them."""

    rows: str  # the list of poses; "" where the message is one
    parent: str
    child: str  # "" where a body is named after its topic
    stamp: str
    place: str
    turn: str


_FOXGLOVE_FRAME = _Layout("", "parent_frame_id", "child_frame_id", "timestamp", "translation", "rotation")
_FOXGLOVE_POSE = _Layout("", "frame_id", "", "timestamp", "pose.position", "pose.orientation")
_TRANSFORM = _Layout(
    "", "header.frame_id", "child_frame_id", "header.stamp", "transform.translation", "transform.rotation"
)
_POSE = _Layout("", "header.frame_id", "", "header.stamp", "pose.position", "pose.orientation")

LAYOUTS: Final[Mapping[str, _Layout]] = {
    "FrameTransform": _FOXGLOVE_FRAME,
    "FrameTransforms": _FOXGLOVE_FRAME._replace(rows="transforms"),
    "PoseInFrame": _FOXGLOVE_POSE,
    "PosesInFrame": _FOXGLOVE_POSE._replace(rows="poses", place="position", turn="orientation"),
    "TransformStamped": _TRANSFORM,
    "TFMessage": _TRANSFORM._replace(rows="transforms"),
    "PoseStamped": _POSE,
    "PoseWithCovarianceStamped": _POSE._replace(place="pose.pose.position", turn="pose.pose.orientation"),
    "PoseArray": _POSE._replace(rows="poses", place="position", turn="orientation"),
}
"""Last word of a schema's name -> where its poses are."""


def _add(one: Received, tree: FrameTree, readings: "Readings") -> int:
    """Hang the poses of a message into the tree; how many bear no stamp of their own."""
    layout, unstamped = LAYOUTS[one.kind], 0
    rows = listed(part(one.message, layout.rows)) if layout.rows else [one.message]
    topic, static = one.topic.strip("/") or "pose", one.topic.endswith("tf_static")
    for place, row in enumerate(rows):
        head = row if layout.child else one.message
        name = text(part(row, layout.child)) if layout.child else f"{topic}/{place}" if layout.rows else topic
        stamp = stamp_of(part(head, layout.stamp))
        unstamped += stamp == 0
        if stamp and not static:
            readings.pose(one.log_ns, stamp)
        numbers = numbers_of(part(row, layout.place), "xyz") + numbers_of(part(row, layout.turn), "xyzw")
        parent = text(part(head, layout.parent))
        if not layout.child and name == parent.strip("/"):
            name = f"{name} pose"  # a topic may bear the name of the frame that its poses are in
        tree.add(parent, name, stamp or one.log_ns, numbers, static=static)
    return unstamped


ALONE: Final = ("data", "value")
"""A field of this name is what its topic is about: the scalar is called as the topic is."""
LARGEST_STAMP: Final = 1 << 62
TEXTS: Final = ("data", "message", "msg")


@dataclass
class _Rows:
    unit: str = ""
    logged: "array[int]" = field(default_factory=lambda: array("q"))
    stamps: "array[int]" = field(default_factory=lambda: array("q"))
    values: list[Any] = field(default_factory=list)

    def add(self, log_ns: int, stamp_ns: int, value: Any) -> None:
        self.logged.append(log_ns)
        self.stamps.append(stamp_ns)
        self.values.append(value)

    def times_ns(self, fit: ClockFit | None) -> Stamps:
        """The stamps; where one is missing, when it was logged, on the clock of the poses."""
        logged, stamps = np.array(self.logged, dtype=np.int64), np.array(self.stamps, dtype=np.int64)
        ahead = 0 if fit is None else np.rint(fit.ahead(logged / 1e9) * 1e9).astype(np.int64)
        return np.where(stamps == 0, logged + ahead, stamps)


class Readings:
    """Numbers and texts, as they come in; ``put_into`` brings their stamps onto the clock of the poses."""

    def __init__(self) -> None:
        self._scalars: dict[str, _Rows] = {}
        self._texts = _Rows()
        self._logged, self._ahead = array("d"), array("d")

    def pose(self, log_ns: int, stamp_ns: int) -> None:
        """A pose was stamped so and logged then: where the two clocks meet."""
        self._logged.append(log_ns / 1e9)
        self._ahead.append((stamp_ns - log_ns) / 1e9)

    def add(self, one: Received) -> None:
        """One message of any kind but poses."""
        topic, message = one.topic.strip("/") or "topic", one.message
        stamp = stamp_of(part(message, "timestamp")) or stamp_of(part(message, "header.stamp"))
        if max(one.log_ns, stamp) > LARGEST_STAMP or min(one.log_ns, stamp) < 0:
            return
        words = next(filter(None, (text(getattr(message, name, None)) for name in TEXTS)), "")
        if words:
            self._texts.add(one.log_ns, stamp, (text(getattr(message, "name", None)) or topic, words))
            return
        found = {name: value for name in _names(message) if np.isfinite(value := number(getattr(message, name, None)))}
        for name, value in found.items():
            alone = name in ALONE and len(found) == 1
            rows = self._scalars.setdefault(topic if alone else f"{topic}/{name}", _Rows(text(part(message, "unit"))))
            rows.add(one.log_ns, stamp, value)

    def put_into(self, samples: Imported) -> Imported:
        """What was read, with these beside it."""
        beside, fit = BesidePoses(), ClockFit.of(self._logged, self._ahead) if self._logged else None
        if fit and not all(all(rows.stamps) for rows in (*self._scalars.values(), self._texts)):
            beside.notes.append(f"what bears no stamp: log times moved onto the clock of the poses by {fit.words}")
        for name, rows in self._scalars.items():
            beside.scalar(name, rows.times_ns(fit), np.array(rows.values), rows.unit)
        times = self._texts.times_ns(fit).tolist()
        events = [Event(time, *words) for time, words in zip(times, self._texts.values, strict=True)]
        return replace(beside.put_into(samples), events=sorted(events, key=lambda event: event.time_ns))


def _names(message: Any) -> Iterator[str]:
    """The fields of a decoded message, whoever decoded it."""
    described = getattr(message, "DESCRIPTOR", None)
    if described is not None:
        yield from described.fields_by_name
    else:
        yield from getattr(message, "__slots__", None) or vars(message)
