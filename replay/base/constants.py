"""Figures and words that several parts of the tool share; each is decided here and nowhere else."""

from __future__ import annotations

from typing import Final

HEADSET_HZ: Final = 90.0
"""Frames per second of the headsets that the tool is made for."""

BUDGET_MS: Final = 1000.0 / HEADSET_HZ
"""Milliseconds of one frame: what a live loop has for everything."""

HELD_FRAMES: Final = 324_000
"""Up to here (an hour at 90 Hz) frames and poses are held in memory: 52 MB per body. Beyond it, poses lie in a
temporary file and frames are decoded again for every pass."""

BLOCK_FRAMES: Final = 16384
"""Frames (three minutes at 90 Hz) that are read or detected together: working memory stays bounded, and a longer block
is no faster."""

VERDICT_FRAMES: Final = 65536
"""Frames whose verdicts are processed together: some 20 MB for 66 pairs, however long the session."""

CAVEAT: Final = (
    "Exact about the recorded poses and these meshes; tracker noise (VIVE: 0.14-0.77 mm frame to frame) is larger than "
    "most margins."
)
"""Stands below every result that is read by people."""
