"""Chooses which detector of one run is compared with which of another."""

from collections.abc import Sequence
from itertools import product
from typing import TypeAlias

from replay.document.run_document import RunDocument
from replay.errors import RunFolderError

Labels: TypeAlias = tuple[str, str]
"""Label of a detector in the first run, and of one in the second."""


def counterparts(first: RunDocument, second: RunDocument, chosen: Sequence[Labels] = ()) -> list[Labels]:
    """Return pairs of labels in the order of the first run, each label at most once.

    The ``chosen`` pairs come first, then equal labels, then the two references. Of the rest, detectors of one row of
    the table are paired, those with the fewest different settings first; a last one of each run is paired in any case.
    Raises ``RunFolderError``: no detector of a chosen label.
    """
    for (label, other), run in product(chosen, (first, second)):
        requested = label if run is first else other
        if requested not in run.detectors:
            raise RunFolderError(f"no detector {requested!r}; there are: {', '.join(run.detectors)}")
    pairs = list(chosen)
    before = [label for label in first.detectors if label not in {pair[0] for pair in chosen}]
    after = [label for label in second.detectors if label not in {pair[1] for pair in chosen}]
    pairs += [(label, label) for label in before if label in after]
    if first.oracle in before and second.oracle in after and first.oracle != second.oracle:
        pairs.append((first.oracle, second.oracle))
    before = [label for label in before if label not in {pair[0] for pair in pairs} and label != first.oracle]
    after = [label for label in after if label not in {pair[1] for pair in pairs} and label != second.oracle]
    pairs += _alike(first, second, before, after)
    order = list(first.detectors)
    return sorted(pairs, key=lambda pair: order.index(pair[0]))


def _alike(first: RunDocument, second: RunDocument, before: list[str], after: list[str]) -> list[Labels]:
    """Return pairs of labels that only one run has."""
    candidates = []
    for label, other in product(before, after):
        old, new = first.detectors[label], second.detectors[other]
        names = old.settings.keys() | new.settings.keys()
        different = sum(old.settings.get(name) != new.settings.get(name) for name in names)
        if old.name == new.name:
            candidates.append((different, before.index(label), after.index(other)))
    pairs: list[Labels] = []
    for _, old_index, new_index in sorted(candidates):
        label, other = before[old_index], after[new_index]
        if all(label != pair[0] and other != pair[1] for pair in pairs):
            pairs.append((label, other))
    left_before = [label for label in before if all(label != pair[0] for pair in pairs)]
    left_after = [label for label in after if all(label != pair[1] for pair in pairs)]
    if len(left_before) == len(left_after) == 1:
        pairs.append((left_before[0], left_after[0]))
    return pairs
