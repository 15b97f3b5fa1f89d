"""Text of a recording as it may be shown: nothing in it commands a terminal, hides, or turns the order of words."""


def shown(text: str, *, lines: bool = False) -> str:
    """The text, with control characters, marks of direction and other invisible ones written as in Python: ``\\x1b``.

    ``lines``: line ends stay.
    """
    if text.isprintable():
        return text
    return "".join(one if _plain(one) or (lines and one == "\n") else repr(one)[1:-1] for one in text)


def drawable(text: str) -> str:
    """The same for matplotlib, which takes what stands between two dollars for mathematics."""
    return shown(text).replace("$", r"\$")


def _plain(letter: str) -> bool:
    # Spaces of any width are not printable for Python.
    return letter.isprintable() or (letter.isspace() and letter > "\x9f" and letter not in "\u2028\u2029")
