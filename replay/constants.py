"""Figures and words that several parts of the tool share; each is decided here and nowhere else."""

from typing import Final

from sessions.model.constants import BLOCK_FRAMES, HEADSET_HZ

__all__ = [
    "BLOCK_FRAMES",
    "BUDGET_MS",
    "CAVEAT",
    "FRAME_BUDGET_LABEL",
    "HEADSET_HZ",
    "MOST_FRAMES_IN_MEMORY",
    "RECORDING",
    "VERDICT_FRAMES",
]

BUDGET_MS: Final = 1000.0 / HEADSET_HZ
"""Milliseconds of one frame: what a live loop has for everything."""

FRAME_BUDGET_LABEL: Final = f"one frame at {HEADSET_HZ:g} Hz"
"""The word of a plot for the budget."""

MOST_FRAMES_IN_MEMORY: Final = 324_000
"""Up to here (an hour at 90 Hz) every frame is drawn, and what a search did and all faces that meet are kept."""

VERDICT_FRAMES: Final = 16384
"""Frames whose verdicts are processed together: some 9 MB for 66 pairs as numpy counts, however long the session."""

CAVEAT: Final = (
    "This is about the recorded poses and these meshes; tracker noise (VIVE: 0.14-0.77 mm frame to frame) is larger "
    "than most margins."
)
"""Stands below every result that is read by people."""

RECORDING: Final = "FILE.mcap"
"""The recording in a command where its name is not printed, since files may be called after people."""
