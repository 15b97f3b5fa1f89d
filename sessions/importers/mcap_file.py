"""Poses in MCAP files of other programs: Foxglove's messages in protobuf or JSON, tf2 and geometry_msgs of ROS 2.

Source: Foxglove schemas, https://docs.foxglove.dev/docs/sdk/schemas; ROS 2 common_interfaces; ROS REP 103, REP 105.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final, NamedTuple

from sessions.importers.finish import Imported
from sessions.importers.frame_tree import FrameTree
from sessions.importers.mcap_messages import Received, received
from sessions.importers.mcap_readings import Readings
from sessions.importers.pose_table import SourceFrame, imported
from sessions.importers.readings import listed, numbers_of, part, stamp_of, text
from sessions.importers.scene_entities import SceneEntities
from sessions.mesh_data import MeshData
from sessions.meshes.conventions import Convention
from sessions.meshes.conventions import convention as convention_named

ASSUMED: Final = "ros"
"""Axes where none are named: Foxglove and ROS both follow REP 103."""


def read_mcap(
    source: Path,
    *,
    convention: str | None = None,
    topics: Sequence[str] = (),
) -> Imported:
    """Everything in an MCAP file of another program.

    A frame is a body of its name; a pose or entity is a body of its topic or id. Stamps are those of the messages.

    Parameters
    ----------
    convention : a name in ``CONVENTIONS``; ``None``: that of ROS.
    topics : read these alone; none: all that hold poses.

    Raises ``ImportFileError``: names file, topic and what to do.
    """
    axes = convention_named(convention or ASSUMED)
    tree, entities = FrameTree(str(source)), SceneEntities(str(source))
    unstamped, readings = 0, Readings()
    for one in received(source, (*LAYOUTS, "SceneUpdate"), topics):
        if one.kind == "SceneUpdate":
            entities.add(one.message, one.log_ns)
        elif one.kind:
            unstamped += _add(one, tree, readings)
        else:
            readings.add(one)
    shapes = entities.hang(tree)
    tables, words = tree.tables()
    words += entities.notes.values()
    if unstamped:
        words.append(f"{unstamped} poses without a stamp have the time they were logged at")
    assumed = [] if convention else [f"axes {ASSUMED} ({axes.words})"]
    frame = SourceFrame(axes, "m", 1.0, "stamps of the messages, ns", "ns", (*assumed, "lengths in m"))
    meshes = {name: _in_axes(mesh, axes) for name, mesh in shapes.items()}
    return replace(readings.put_into(imported(tables, frame, words), frame), meshes=meshes)


def _in_axes(mesh: MeshData, axes: Convention) -> MeshData:
    faces = mesh.faces if axes.handedness == "right" else mesh.faces[:, ::-1]
    return MeshData(axes.points(mesh.vertices), faces)


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


def _add(one: Received, tree: FrameTree, readings: Readings) -> int:
    """Hang the poses of a message into the tree; how many bear no stamp of their own."""
    layout, unstamped = LAYOUTS[one.kind], 0
    rows = listed(part(one.message, layout.rows)) if layout.rows else [one.message]
    topic, static = one.topic.strip("/") or "pose", one.topic.endswith("tf_static")
    for number, row in enumerate(rows):
        head = row if layout.child else one.message
        name = text(part(row, layout.child)) if layout.child else f"{topic}/{number}" if layout.rows else topic
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
