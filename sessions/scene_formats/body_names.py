"""Names of bodies that are different, where a scene calls several the same."""

from collections import Counter
from collections.abc import Sequence
from typing import Final

MOST_NAMED: Final = 5


def distinct_names(paths: Sequence[Sequence[str]]) -> list[str]:
    """The last step of each path, with as many of the steps above as make it different, joined by ``/``.

    Paths that are equal get a number: ``cup``, ``cup-2``.

    Examples
    --------
    >>> distinct_names([("left", "cup"), ("right", "cup"), ("right", "tray")])
    ['left/cup', 'right/cup', 'tray']
    """
    lengths = [1] * len(paths)
    while True:
        names = ["/".join(path[-length:]) for path, length in zip(paths, lengths, strict=True)]
        counts = Counter(names)
        growing = [k for k, name in enumerate(names) if counts[name] > 1 and lengths[k] < len(paths[k])]
        if not growing:
            break
        for k in growing:
            lengths[k] += 1
    used, counts = {*names}, Counter[str]()
    for k, name in enumerate(names):
        counts[name] += 1
        if counts[name] > 1:
            number = counts[name]
            while f"{name}-{number}" in used:
                number += 1
            names[k] = f"{name}-{number}"
            used.add(names[k])
    return names


def repeated_names(own: Sequence[str], names: Sequence[str]) -> tuple[str, ...]:
    """A sentence on the bodies that have another name than their own, or none.

    Examples
    --------
    >>> repeated_names(["cup", "cup", "tray"], ["left/cup", "right/cup", "tray"])
    ("names that are there more than once: 'left/cup' for 'cup', 'right/cup' for 'cup'",)
    """
    renamed = [(name, before) for name, before in zip(names, own, strict=True) if name != before]
    if not renamed:
        return ()
    listed = ", ".join(f"{name!r} for {before!r}" for name, before in renamed[:MOST_NAMED])
    more = f" and {len(renamed) - MOST_NAMED:,} more" if len(renamed) > MOST_NAMED else ""
    return (f"names that are there more than once: {listed}{more}",)
