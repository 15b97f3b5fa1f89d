"""Chooses which detector of one run is compared with which of another."""

from collections.abc import Sequence
from itertools import product
from typing import TypeAlias

from replay.document.run_document import RunDocument
from replay.errors import RunFolderError

Labels: TypeAlias = tuple[str, str]
"""Label of a detector in the first run, and of one in the second."""


def counterparts(first: RunDocument, second: RunDocument, chosen_pairs: Sequence[Labels] = ()) -> list[Labels]:
    """Return pairs of labels in the order of the first run, each label at most once.

    ``chosen_pairs`` come first, then equal labels, then the two references. Of the rest, detectors of one row of
    the table are paired, those with the fewest different settings first; a last one of each run is paired in any case.
    Raises ``RunFolderError``: no detector of a chosen label.
    """
    for (label, other), run in product(chosen_pairs, (first, second)):
        requested_label = label if run is first else other
        if requested_label not in run.detectors:
            raise RunFolderError(f"no detector {requested_label!r}; there are: {', '.join(run.detectors)}")
    pairs = list(chosen_pairs)
    first_labels = [label for label in first.detectors if label not in {pair[0] for pair in chosen_pairs}]
    second_labels = [label for label in second.detectors if label not in {pair[1] for pair in chosen_pairs}]
    pairs += [(label, label) for label in first_labels if label in second_labels]
    if first.oracle in first_labels and second.oracle in second_labels and first.oracle != second.oracle:
        pairs.append((first.oracle, second.oracle))
    first_labels = [
        label for label in first_labels if label not in {pair[0] for pair in pairs} and label != first.oracle
    ]
    second_labels = [
        label for label in second_labels if label not in {pair[1] for pair in pairs} and label != second.oracle
    ]
    pairs += _similar_pairs(first, second, first_labels, second_labels)
    order = list(first.detectors)
    return sorted(pairs, key=lambda pair: order.index(pair[0]))


def _similar_pairs(
    first: RunDocument, second: RunDocument, first_labels: list[str], second_labels: list[str]
) -> list[Labels]:
    """Return pairs of labels that only one run has."""
    candidates = []
    for label, other in product(first_labels, second_labels):
        old, new = first.detectors[label], second.detectors[other]
        names = old.settings.keys() | new.settings.keys()
        different = sum(old.settings.get(name) != new.settings.get(name) for name in names)
        if old.name == new.name:
            candidates.append((different, first_labels.index(label), second_labels.index(other)))
    pairs: list[Labels] = []
    for _, old_index, new_index in sorted(candidates):
        label, other = first_labels[old_index], second_labels[new_index]
        if all(label != pair[0] and other != pair[1] for pair in pairs):
            pairs.append((label, other))
    first_left = [label for label in first_labels if all(label != pair[0] for pair in pairs)]
    second_left = [label for label in second_labels if all(label != pair[1] for pair in pairs)]
    if len(first_left) == len(second_left) == 1:
        pairs.append((first_left[0], second_left[0]))
    return pairs
