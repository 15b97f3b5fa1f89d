"""Mappings by the label of a detector, whose error says which labels there are."""

from __future__ import annotations

from typing import NoReturn, TypeVar

from replay.errors import UnknownLabelError

Value = TypeVar("Value")


class ByLabel(dict[str, Value]):
    """A mapping by label; an UnknownLabelError lists the labels there are.

    Examples
    --------
    >>> ByLabel(exact=1, hull50=2)["hull"]
    Traceback (most recent call last):
        ...
    replay.errors.UnknownLabelError: no label 'hull' here; there are: exact, hull50
    """

    def __missing__(self, label: object) -> NoReturn:
        known_labels = ", ".join(self) or "none"
        raise UnknownLabelError(f"no label {label!r} here; there are: {known_labels}")
