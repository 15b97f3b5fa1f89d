"""Every colour of terminal, page and picture, once: one red means *missed* and nothing else; silence has no colour.

Red, yellow and blue differ in lightness too, so that they stay apart for readers who see hues differently.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from cdcore import Verdict
from replay.comparison.outcome import Outcome
from replay.outputs.words import NOISE_WORDS, OUTCOME_WORDS, VERDICT_WORDS

Rgba = tuple[int, int, int, int]


def mixed(colour: Rgba, other: Rgba, share: float) -> Rgba:
    """A colour with this share of another one in it; its alpha stays."""
    r, g, b = (round(a + share * (z - a)) for a, z in zip(colour[:3], other[:3], strict=True))
    return r, g, b, colour[3]


def hex_of(colour: Rgba) -> str:
    """``#rrggbb``, without alpha."""
    return "#{:02x}{:02x}{:02x}".format(*colour[:3])


BLACK: Final[Rgba] = (0, 0, 0, 255)
PAPER: Final[Rgba] = (255, 255, 255, 255)

MISSED: Final[Rgba] = (255, 45, 85, 255)
"""The one red. Nothing that is not missed may wear it; its shades below are made from it."""

MISSED_DARK: Final = mixed(MISSED, BLACK, 0.31)
"""Neighbouring numbers in the number lane alternate between the red and this."""

PARTLY_MISSED: Final = mixed(MISSED, PAPER, 0.44)
"""For a miss whose contact was found late, lost early or interrupted."""

MISSED_FACES: Final[Rgba] = (*MISSED[:3], 150)
"""A veil over faces: the curve of intersection stays visible through it."""

INVENTED: Final[Rgba] = (255, 204, 0, 255)
FOUND: Final[Rgba] = (58, 122, 168, 255)
"""Contact that both detectors report."""

WITHIN_TOLERANCE: Final[Rgba] = (96, 100, 108, 255)
BETWEEN_FRAMES: Final[Rgba] = (126, 104, 176, 255)
HELD: Final[Rgba] = (58, 110, 96, 255)
"""Contact of a hand with what it holds: no news."""

FAINT: Final[Rgba] = (40, 42, 48, 255)
"""For what was not decided: visible, but weaker than all other colours."""

WHITE: Final[Rgba] = (235, 235, 240, 255)
BACKGROUND: Final[Rgba] = (17, 20, 26, 255)
BUDGET: Final[Rgba] = (150, 152, 160, 255)
GRID: Final[Rgba] = (58, 62, 70, 255)
TICKS: Final[Rgba] = (190, 194, 200, 255)

SERIES: Final[tuple[Rgba, ...]] = (
    (86, 180, 233, 255),
    (245, 146, 62, 255),
    (61, 201, 123, 255),
    (190, 148, 230, 255),
    (222, 210, 160, 255),
    (140, 160, 175, 255),
)
"""Colours of detectors in plots, in order; none of them is near the red or the yellow."""

DOUBTS: Final[tuple[Rgba, ...]] = (
    SERIES[3], (160, 120, 210, 255), (130, 96, 190, 255), SERIES[1], (150, 110, 60, 255), SERIES[0], SERIES[2],
    WITHIN_TOLERANCE, (90, 120, 120, 255),
)  # fmt: skip
"""Colours of poses in doubt, in the order of ``replay.prepare.flags.FLAG_KINDS``."""

Looks = Mapping[int, tuple[str, Rgba]]
"""State of a lane -> its word and colour; a state without a row is a gap."""


def looks(words: Mapping[int, str], colours: Mapping[int, Rgba]) -> Looks:
    """Words and colours of the same states in one table."""
    return MappingProxyType({state: (word, colours[state]) for state, word in words.items()})


OUTCOMES: Final = looks(
    OUTCOME_WORDS,
    {
        Outcome.BOTH: FOUND, Outcome.MISSED: MISSED, Outcome.INVENTED: INVENTED,
        Outcome.WITHIN_TOLERANCE: WITHIN_TOLERANCE, Outcome.BETWEEN_FRAMES: BETWEEN_FRAMES, Outcome.LEFT_OUT: FAINT,
        Outcome.HELD: HELD,
    },
)  # fmt: skip
"""States of an audit lane."""

VERDICTS: Final = looks(
    VERDICT_WORDS,
    {
        Verdict.CONTACT: FOUND, Verdict.CONTAINED: (38, 150, 150, 255), Verdict.CANDIDATE: (112, 132, 150, 255),
        Verdict.NOT_FOUND: FAINT, Verdict.UNRESOLVED: (150, 110, 60, 255), Verdict.INVALID: (120, 90, 60, 255),
        Verdict.NO_POSE: FAINT,
    },
)  # fmt: skip
"""States of a detector lane."""

NOISES: Final = looks(NOISE_WORDS, dict(zip(NOISE_WORDS, (SERIES[1], SERIES[4], WITHIN_TOLERANCE, FOUND), strict=True)))
"""States of a lane of noise."""
