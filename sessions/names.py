"""Words in names of bodies by which a head, a hand and its side are recognised."""

import re
from typing import Final

HEAD_WORDS: Final = frozenset({"head", "hmd", "headset", "camera"})
HAND_WORDS: Final = frozenset({"hand", "controller", "wand", "glove"})
"""A tracked hand, or the device that stands for it."""
SIDES: Final = ("left", "right")
DEVICE_WORDS: Final = frozenset({"vive", "index"})
"""Words of products, which name no side and no kind of device."""

_SIDE_OF_PREFIX: Final = {"l": "left", "r": "right", "left": "left", "right": "right"}
_JOINED: Final = re.compile(f"(l|r|left|right)?({'|'.join(sorted(HAND_WORDS))})(left|right)?")
"""A hand and its side in one word, such as "lhand", "lefthand" and "handleft"."""


def name_tokens(name: str) -> list[str]:
    """The words of a name in small letters: those of "LeftHand_2" and "lhand" are "left" and "hand"."""
    words = [word.lower() for word in re.findall("[A-Z]?[a-z]+|[A-Z]+(?![a-z])", name)]
    tokens = [token for word in words for token in _separated(word)]
    return tokens if HAND_WORDS.isdisjoint(tokens) else [_SIDE_OF_PREFIX.get(token, token) for token in tokens]


def _separated(word: str) -> list[str]:
    match = _JOINED.fullmatch(word)
    if match is None:
        return [word]
    before, hand, after = match.groups()
    return [token for token in (_SIDE_OF_PREFIX.get(before), hand, after) if token]


def is_head(name: str) -> bool:
    """Whether a word of the name is one of a head."""
    return not HEAD_WORDS.isdisjoint(name_tokens(name))


def is_hand(name: str) -> bool:
    """Whether a word of the name is one of a hand; "handle" is none."""
    return not HAND_WORDS.isdisjoint(name_tokens(name))


def side_of(name: str) -> str:
    """The side, "left" or "right", where a word of the name begins with it, else an empty text."""
    tokens = name_tokens(name)
    return next((side for side in SIDES if any(token.startswith(side) for token in tokens)), "")
