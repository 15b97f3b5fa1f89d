"""Every colour of the picture, once: one red means *missed* and nothing else, and silence has no colour.

Red, yellow and blue differ in lightness too, so that they stay apart for readers who see hues differently.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cdcore import Verdict
from replay.audit.outcome import Outcome

Rgba = tuple[int, int, int, int]

MISSED: Final[Rgba] = (255, 45, 85, 255)
"""The one red. Nothing that is not missed may wear it."""

MISSED_DARK: Final[Rgba] = (176, 18, 52, 255)
"""Its darker twin: neighbouring numbers in the number lane alternate between the two."""

PARTLY_MISSED: Final[Rgba] = (255, 138, 158, 255)
"""A paler one for the line of a miss whose contact was found late, lost early or interrupted."""

MISSED_FACES: Final[Rgba] = (255, 45, 85, 150)
"""The red as a veil over faces, so that the curve of intersection stays visible through it."""

INVENTED: Final[Rgba] = (255, 204, 0, 255)
FOUND: Final[Rgba] = (58, 122, 168, 255)
"""Contact that both detectors report."""
WITHIN_TOLERANCE: Final[Rgba] = (96, 100, 108, 255)
BETWEEN_FRAMES: Final[Rgba] = (126, 104, 176, 255)
FAINT: Final[Rgba] = (40, 42, 48, 255)
"""For what was not decided: there, but below everything that speaks."""

WHITE: Final[Rgba] = (235, 235, 240, 255)
BACKGROUND: Final[Rgba] = (17, 20, 26, 255)
BUDGET: Final[Rgba] = (150, 152, 160, 255)

SERIES: Final[tuple[Rgba, ...]] = (
    (86, 180, 233, 255),
    (245, 146, 62, 255),
    (61, 201, 123, 255),
    (190, 148, 230, 255),
    (222, 210, 160, 255),
    (140, 160, 175, 255),
)
"""Colours of detectors in plots, in order; none of them is near the red or the yellow."""

OUTCOME_WORDS: Final[Mapping[int, tuple[str, Rgba]]] = MappingProxyType(
    {
        Outcome.BOTH: ("both", FOUND),
        Outcome.MISSED: ("MISSED", MISSED),
        Outcome.INVENTED: ("invented", INVENTED),
        Outcome.WITHIN_TOLERANCE: ("within tolerance", WITHIN_TOLERANCE),
        Outcome.BETWEEN_FRAMES: ("between frames", BETWEEN_FRAMES),
        Outcome.LEFT_OUT: ("left out", FAINT),
    }
)
"""Word and colour of an audit lane's states; NEITHER is a gap."""

VERDICT_WORDS: Final[Mapping[int, tuple[str, Rgba]]] = MappingProxyType(
    {
        Verdict.CONTACT: ("CONTACT", FOUND),
        Verdict.CONTAINED: ("CONTAINED", (38, 150, 150, 255)),
        Verdict.CANDIDATE: ("CANDIDATE", (112, 132, 150, 255)),
        Verdict.NOT_FOUND: ("NOT_FOUND", FAINT),
        Verdict.UNRESOLVED: ("UNRESOLVED", (150, 110, 60, 255)),
        Verdict.INVALID: ("INVALID", (120, 90, 60, 255)),
        Verdict.NO_POSE: ("NO_POSE", FAINT),
    }
)
"""Word and colour of a detector lane's states; CLEAR is a gap."""


def packed(colours: Iterable[Rgba]) -> NDArray[np.uint32]:
    """Colours as 0xRRGGBBAA, (n,) uint32: Rerun takes Python integers for floats in some places."""
    values = [(r << 24) | (g << 16) | (b << 8) | a for r, g, b, a in colours]
    return np.array(values, dtype=np.uint32)
