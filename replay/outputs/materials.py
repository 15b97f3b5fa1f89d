"""What a body looks like follows from its tags: glass is translucent, hands never hide a contact."""

import re
from typing import Final

from replay.outputs.palette import Rgba
from sessions.model.scene import Scene

GHOST_ALPHA: Final = 40
"""Hands and headset: opaque ones stand in front of what they touch."""

_BY_TAG: Final[tuple[tuple[str, Rgba], ...]] = (
    ("headset", (120, 150, 200, 26)),
    ("hand", (150, 175, 215, GHOST_ALPHA)),
    ("controller", (150, 175, 215, GHOST_ALPHA)),
    ("wand", (150, 175, 215, GHOST_ALPHA)),
    ("stopper", (120, 116, 108, 255)),
    ("rod", (222, 226, 232, 255)),
    ("glass", (150, 205, 240, 34)),
    ("bench", (62, 66, 74, 255)),
    ("table", (62, 66, 74, 255)),
    ("metal", (146, 150, 158, 255)),
    ("porcelain", (226, 222, 212, 255)),
    ("rack", (126, 106, 84, 255)),
    ("furniture", (110, 114, 122, 255)),
    ("plastic", (88, 110, 140, 255)),
)
"""First tag that fits decides. A rod is of glass, but it is solid and thin: translucent it vanishes inside a beaker."""

_DEFAULT: Final[Rgba] = (168, 164, 156, 255)


def tags_of(body: str, scene: Scene) -> tuple[str, ...]:
    """Tags of a body as declared; for a body that declares none, the words of its name."""
    declared = scene.body(body)
    if declared is not None and declared.tags:
        return declared.tags
    words = [word for word in re.split(r"[^a-z]+", body.lower()) if word]
    return tuple(words)


def albedo(tags: tuple[str, ...]) -> Rgba:
    """Colour and translucency of a body with these tags."""
    return next((colour for tag, colour in _BY_TAG if tag in tags), _DEFAULT)


def is_ghost(tags: tuple[str, ...]) -> bool:
    """Whether the body belongs to the user (hand, controller, headset): drawn, but never in the way."""
    return bool({"hand", "controller", "wand", "headset"} & set(tags))
