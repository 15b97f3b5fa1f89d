"""Words in names of bodies by which a head, a hand and its side are recognised."""

import re
from typing import Final

HEAD_TOKENS: Final = frozenset({"head", "hmd", "headset", "camera"})
HAND_TOKENS: Final = frozenset({"hand", "controller", "wand", "glove"})
"""A tracked hand, or the device that stands for it."""
SIDES: Final = ("left", "right")
DEVICE_TOKENS: Final = frozenset({"vive", "index"})
"""Words of products, which name no side and no kind of device."""

_SIDE_OF_PREFIX: Final = {"l": "left", "r": "right", "left": "left", "right": "right"}
_HANDS: Final = "|".join(sorted(HAND_TOKENS))
_JOINED: Final = re.compile(f"(l|r|left|right)?({_HANDS})(left|right|anchor|mesh|model|tracker)?")
"""A hand and its side in one word, such as "lhand", "lefthand" and "handleft", or a hand and its role: "handmodel"."""
_SIDE_FIRST: Final = re.compile(f"(left|right)({_HANDS})(.*)")
"""A word that begins with a side and a hand, such as "righthandanchor"."""
_GLOVE_BOX: Final = ("glove", "box")
"""A piece of furniture."""


def name_tokens(name: str) -> list[str]:
    """The words of a name in small letters: those of "LeftHand_2" and "lhand" are "left" and "hand"."""
    pieces = [word.lower() for word in re.findall("[A-Z]?[a-z]+|[A-Z]+(?![a-z])", name)]
    tokens = [token for word in pieces for token in _separated_words(word)]
    return tokens if HAND_TOKENS.isdisjoint(tokens) else [_SIDE_OF_PREFIX.get(token, token) for token in tokens]


def _separated_words(word: str) -> list[str]:
    match = _JOINED.fullmatch(word) or _SIDE_FIRST.fullmatch(word)
    if match is None:
        return [word]
    before, hand, after = match.groups()
    return [token for token in (_SIDE_OF_PREFIX.get(before), hand, after) if token]


def is_head(name: str) -> bool:
    """Whether a word of the name is one of a head."""
    return not HEAD_TOKENS.isdisjoint(name_tokens(name))


def is_hand(name: str) -> bool:
    """Whether a word of the name is one of a hand; "handle" and "glove box" are none."""
    tokens = name_tokens(name)
    hands = [k for k, token in enumerate(tokens) if token in HAND_TOKENS]
    return any(tuple(tokens[k : k + 2]) != _GLOVE_BOX for k in hands)


def side_of(name: str) -> str:
    """The side, "left" or "right", where a word of the name begins with it, else an empty text."""
    tokens = name_tokens(name)
    return next((side for side in SIDES if any(token.startswith(side) for token in tokens)), "")
