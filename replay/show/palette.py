"""Every colour of terminal, page and picture, once: one red means *missed* and nothing else; silence has no colour.

Red, yellow and blue differ in lightness too, so that they stay apart for readers who see hues differently. What a body
looks like follows from its tags: glass is translucent, hands never hide a contact.
"""

import re
from collections.abc import Mapping
from typing import Final

from cdcore import Verdict
from replay.auditing.fault import FaultKind
from replay.auditing.outcome import Outcome
from replay.document.tables import package_toml
from replay.show.words import OUTCOME_LABELS
from sessions.model.scene import Scene

Rgba = tuple[int, int, int, int]


def hex_of(colour: Rgba) -> str:
    """``#rrggbb``, without alpha."""
    return "#{:02x}{:02x}{:02x}".format(*colour[:3])


def rgba_of(text: str) -> Rgba:
    """Colour of ``#rrggbb``, opaque."""
    red, green, blue = bytes.fromhex(text[1:])
    return red, green, blue, 255


LIGHT_COLOURS: Final[Mapping[str, str]] = {
    "reference": "#3f4752",
    "right": "#2f78c4",
    "missed": "#c9202f",
    "late": "#f0709b",
    "false": "#f2b400",
}
"""Kind of an interval -> its colour on a light page."""

DARK_COLOURS: Final[Mapping[str, str]] = {
    "reference": "#c3ccd6",
    "right": "#4f9be8",
    "missed": "#ff2d3c",
    "late": "#ed5e8e",
    "false": "#ffcc00",
}
"""Kind -> its colour on a dark page, in pictures, and in the viewer, which is dark."""


def page_colours() -> str:
    """Return the colours of pages as variables of their style sheet."""
    light_variables = "".join(
        f"--{kind}:{colour};--{kind}-dark:{DARK_COLOURS[kind]};" for kind, colour in LIGHT_COLOURS.items()
    )
    dark_variables = "".join(f"--{kind}:{colour};" for kind, colour in DARK_COLOURS.items())
    return f":root{{{light_variables}}}@media (prefers-color-scheme:dark){{:root{{{dark_variables}}}}}"


PAPER: Final[Rgba] = (255, 255, 255, 255)

MISSED: Final[Rgba] = rgba_of(DARK_COLOURS["missed"])
"""The one red. Nothing that is not missed may wear it; its shades below are made from it."""

VEIL_ALPHA: Final = 150
"""Alpha of a colour over faces: the curve of intersection stays visible through it."""

REFERENCE: Final[Rgba] = rgba_of(DARK_COLOURS["reference"])
"""Contact of the reference, whatever a detector makes of it."""

LATE: Final[Rgba] = rgba_of(DARK_COLOURS["late"])
"""Contact that is missed in a part, since it was reported late or cut short."""

FALSE_CONTACT: Final[Rgba] = rgba_of(DARK_COLOURS["false"])
TRUE_CONTACT: Final[Rgba] = rgba_of(DARK_COLOURS["right"])
"""Contact that both detectors report."""

WITHIN_TOLERANCE: Final[Rgba] = (96, 100, 108, 255)
BETWEEN_FRAMES: Final[Rgba] = (126, 104, 176, 255)
GRASPED: Final[Rgba] = (58, 110, 96, 255)
"""Contact of a hand with what it holds: no news."""

FREE: Final[Rgba] = (255, 255, 255, 255)
"""A body that touches nothing, while a detector says that it does."""

FAINT: Final[Rgba] = (40, 42, 48, 255)
"""For what was not decided: visible, but weaker than all other colours."""

WHITE: Final[Rgba] = (235, 235, 240, 255)
BACKGROUND: Final[Rgba] = (17, 20, 26, 255)
BUDGET: Final[Rgba] = (150, 152, 160, 255)
TICKS: Final[Rgba] = (190, 194, 200, 255)

SERIES_COLOURS: Final[tuple[Rgba, ...]] = (
    (86, 180, 233, 255),
    (245, 146, 62, 255),
    (61, 201, 123, 255),
    (190, 148, 230, 255),
    (222, 210, 160, 255),
    (140, 160, 175, 255),
)
"""Colours of detectors in plots, in order; none of them is near the red or the yellow."""


def fault_key(kind: FaultKind) -> str:
    """Return the kind of a fault in a lane, which has a colour in both tables: missed, late or false."""
    if not kind.is_miss:
        return "false"
    return "missed" if kind is FaultKind.NEVER_REPORTED else "late"


def fault_colour(kind: FaultKind) -> Rgba:
    """Return the colour of a fault in pictures: red, pink or yellow."""
    return rgba_of(DARK_COLOURS[fault_key(kind)])


COLOUR_NAMES: Final = {"missed": "red", "late": "pink", "false": "yellow"}
"""Key of a fault -> its colour in words."""

LATE_LOOK: Final = ("late", LATE)
"""Word and colour of missed frames of a contact that was reported late or cut short."""

Looks = Mapping[int, tuple[str, Rgba]]
"""State of a lane -> its word and colour; a state without a row is a gap."""

OUTCOME_STYLES: Final[Looks] = {
    outcome: (OUTCOME_LABELS[outcome], colour)
    for outcome, colour in {
        Outcome.BOTH: TRUE_CONTACT,
        Outcome.MISSED: MISSED,
        Outcome.FALSE_CONTACT: FALSE_CONTACT,
        Outcome.WITHIN_TOLERANCE: WITHIN_TOLERANCE,
        Outcome.BETWEEN_FRAMES: BETWEEN_FRAMES,
        Outcome.LEFT_OUT: FAINT,
        Outcome.GRASPED: GRASPED,
    }.items()
}
"""States of an audit lane."""

VERDICT_STYLES: Final[Looks] = {
    verdict: (verdict.name, colour)
    for verdict, colour in {
        Verdict.CONTACT: REFERENCE,
        Verdict.CONTAINED: (38, 150, 150, 255),
        Verdict.CANDIDATE: (112, 132, 150, 255),
        Verdict.NOT_FOUND: FAINT,
        Verdict.UNRESOLVED: (150, 110, 60, 255),
        Verdict.INVALID: (120, 90, 60, 255),
        Verdict.NO_POSE: FAINT,
    }.items()
}
"""States of a detector lane, in words of the glossary; CLEAR is a gap."""

COLOUR_BY_TAG: Final[Mapping[str, Rgba]] = {
    tag: tuple(colour) for tag, colour in package_toml("show/palette.toml").items()
}

_DEFAULT: Final[Rgba] = (168, 164, 156, 255)


_SEE_THROUGH: Final = 110
"""Alpha, at most, of a body that stands before the point of a picture."""

GROUND_TAGS: Final = frozenset({"bench", "table", "furniture"})
"""Tags of what stays solid."""


def tags_of(body: str, scene: Scene) -> tuple[str, ...]:
    """Tags of a body as declared; for a body that declares none, the words of its name."""
    declared_body = scene.body(body)
    if declared_body is not None and declared_body.tags:
        return declared_body.tags
    tokens = [word for word in re.split(r"[^a-z]+", body.lower()) if word]
    return tuple(tokens)


def albedo(tags: tuple[str, ...]) -> Rgba:
    """Colour and translucency of a body with these tags."""
    return next((colour for tag, colour in COLOUR_BY_TAG.items() if tag in tags), _DEFAULT)


def see_through(tags: tuple[str, ...]) -> Rgba:
    """The same, such that one can look through the body; the ground stays solid."""
    colour = albedo(tags)
    return (*colour[:3], min(colour[3], _SEE_THROUGH)) if GROUND_TAGS.isdisjoint(tags) else colour
