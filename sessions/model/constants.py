"""Figures of recordings that several parts of sessions and tool share; each is decided here and nowhere else."""

from typing import Final

SPACE_RADIUS: Final = 1000.0
"""Metres from the origin beyond which no room holds a pose, unless the scene says otherwise."""

HEADSET_HZ: Final = 90.0
"""Frames per second of the headsets that the tool is made for, and of synthetic sessions by default."""

BRIDGE_NS: Final = 50_000_000
"""A sample speaks for at most 50 ms: five samples of a 90 Hz tracker, and 1-2 cm of an ordinary hand movement."""

BLOCK_FRAMES: Final = 16384
"""Frames (three minutes at 90 Hz) that are read or detected together: working memory stays bounded, and a longer block
is no faster."""

SCENE_FACT: Final = "scene_file"
"""The fact that names the file of a scene which stands in place of the recording's own; no file keeps it."""
