"""Text as it may be shown: nothing of a recording commands a terminal, hides, or turns words; and plurals."""


def shown(text: str, *, lines: bool = False) -> str:
    """The text, with control characters, marks of direction and other invisible ones written as in Python: ``\\x1b``.

    ``lines``: line ends stay.
    """
    if text.isprintable():
        return text
    return "".join(
        character if _plain(character) or (lines and character == "\n") else repr(character)[1:-1] for character in text
    )


def drawable(text: str) -> str:
    """The same for matplotlib, which takes what stands between two dollars for mathematics."""
    return shown(text).replace("$", r"\$")


def _plain(letter: str) -> bool:
    # Spaces of any width are not printable for Python.
    return letter.isprintable() or (letter.isspace() and letter > "\x9f" and letter not in "\u2028\u2029")


def plural(number: int, thing: str, several: str = "") -> str:
    """``1 frame``, ``2 frames``; ``several`` where an s is not enough."""
    return f"{number:,} {thing if number == 1 else several or thing + 's'}"
