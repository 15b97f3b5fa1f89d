"""Text of mesh files as bytes: numbers and keywords are ASCII in every format, names may be in any encoding of it."""

import codecs
import re
import warnings
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sessions.errors import MeshFileError
from sessions.file_kinds import named_encoding

SIGN_ALONE: Final = re.compile(rb"[+-](?![0-9.a-zA-Z])")
"""A sign without a number behind it."""

FIRST_BYTES: Final = 64
"""Enough to tell by zero bytes whether text without a mark takes two bytes a letter."""


def ascii_text(data: bytes) -> bytes:
    """Return the bytes without a byte order mark of UTF-8; raises ``MeshFileError`` for text of UTF-16 or UTF-32."""
    if encoding := named_encoding(data):
        raise MeshFileError(f"its text is in {encoding}; save it as UTF-8")
    start = data[:FIRST_BYTES]
    for zeros, others in ((start[1::2], start[::2]), (start[::2], start[1::2])):
        if len(start) > 4 and not any(zeros) and all(others):
            raise MeshFileError("its text is in UTF-16; save it as UTF-8")
    return data.removeprefix(codecs.BOM_UTF8)


def numbers(text: bytes, where: str) -> NDArray[np.float64]:
    """Return the decimal numbers of a text, (n,) float64, each the nearest to what is written.

    ``where`` it stands, for the ``MeshFileError`` about a word that is no number.
    """
    return _parse_numbers(text, np.float64, where, "number")


def whole_numbers(text: bytes, where: str) -> NDArray[np.int64]:
    """Return the whole numbers of a text, (n,) int64; errors as in ``numbers``."""
    return _parse_numbers(text, np.int64, where, "whole number")


def _parse_numbers(text: bytes, kind: type[np.generic], where: str, noun: str) -> NDArray[Any]:
    values = _numbers_of_text(text, kind)
    if values is not None:
        return values
    bad = next((word for word in text.split() if _numbers_of_text(word, kind) is None), text)
    raise MeshFileError(f"{where} holds {quoted_word(bad)}, which is no {noun}; export it again")


def _numbers_of_text(text: bytes, kind: type[np.generic]) -> NDArray[Any] | None:
    """The numbers of a text, one for each word of it; ``None`` where a word is no number.

    NumPy's parser takes no underscore, comma or hexadecimal digit. But it reads ``1.5.5`` and ``1-2`` as two numbers
    each and, of whole numbers, a sign alone as 0 or as that of the next word: so words are counted, signs checked.
    """
    count = _word_count(text)
    if not count:
        return np.zeros(0, dtype=kind)
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)  # how older versions report it
        try:
            values = np.fromstring(text, dtype=kind, sep=" ")
        except (ValueError, DeprecationWarning):
            return None
    is_signed = b"-" in text or b"+" in text
    if len(values) != count or (is_signed and SIGN_ALONE.search(text)):
        return None
    return values


def _word_count(text: bytes) -> int:
    """How many words a text has, apart by blanks and ends of lines."""
    codes = np.frombuffer(text, dtype=np.uint8)
    is_blank = (codes == ord(" ")) | ((codes >= ord("\t")) & (codes <= ord("\r")))
    is_first = ~is_blank
    is_first[1:] &= is_blank[:-1]
    return int(np.count_nonzero(is_first))


def quoted_word(word: bytes) -> str:
    """Return a word of a file as it may stand in a sentence: in quotes, cut after 40 letters, escaped."""
    return repr(word[:40].decode("latin-1") + "..." * (len(word) > 40))
