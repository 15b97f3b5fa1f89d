"""An MCAP of Foxglove's frame transforms in JSON, as a program of somebody else writes it."""

import json

from mcap.writer import Writer


def write_transforms(path, rows):
    """``rows``: (name, stamp in ns, position, quaternion xyzw), all in the frame ``world``."""
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = writer.register_schema("foxglove.FrameTransform", "jsonschema", b"{}")
        channel = writer.register_channel("/tf", "json", schema)
        for name, stamp, position, quaternion in rows:
            message = {
                "timestamp": {"sec": stamp // 10**9, "nsec": stamp % 10**9},
                "parent_frame_id": "world",
                "child_frame_id": name,
                "translation": dict(zip("xyz", map(float, position), strict=True)),
                "rotation": dict(zip("xyzw", map(float, quaternion), strict=True)),
            }
            writer.add_message(channel, stamp, json.dumps(message).encode(), stamp)
        writer.finish()
    return path
