"""Chooses which detector of one run is compared with which of another."""

from collections.abc import Sequence
from itertools import product
from typing import TypeAlias

from replay.document.run_document import RunDocument
from replay.errors import RunFolderError

Labels: TypeAlias = tuple[str, str]
"""Label of a detector in the first run, and of one in the second."""


def matching_labels(
    first_run: RunDocument, second_run: RunDocument, chosen_pairs: Sequence[Labels] = ()
) -> list[Labels]:
    """Return pairs of labels in the order of the first run, each label at most once.

    ``chosen_pairs`` come first, then equal labels, then the two references. Of the rest, detectors of one row of
    the table are paired, those with the fewest different settings first; a last one of each run is paired in any case.
    Raises ``RunFolderError``: no detector of a chosen label.
    """
    for (label, other), run in product(chosen_pairs, (first_run, second_run)):
        requested_label = label if run is first_run else other
        if requested_label not in run.detectors:
            raise RunFolderError(f"no detector {requested_label!r}; there are: {', '.join(run.detectors)}")
    pairs = list(chosen_pairs)
    first_labels = [label for label in first_run.detectors if label not in {pair[0] for pair in chosen_pairs}]
    second_labels = [label for label in second_run.detectors if label not in {pair[1] for pair in chosen_pairs}]
    pairs += [(label, label) for label in first_labels if label in second_labels]
    if (
        first_run.oracle in first_labels
        and second_run.oracle in second_labels
        and first_run.oracle != second_run.oracle
    ):
        pairs.append((first_run.oracle, second_run.oracle))
    first_labels = [
        label for label in first_labels if label not in {pair[0] for pair in pairs} and label != first_run.oracle
    ]
    second_labels = [
        label for label in second_labels if label not in {pair[1] for pair in pairs} and label != second_run.oracle
    ]
    pairs += _similar_pairs(first_run, second_run, first_labels, second_labels)
    order = list(first_run.detectors)
    return sorted(pairs, key=lambda pair: order.index(pair[0]))


def _similar_pairs(
    first_run: RunDocument, second_run: RunDocument, first_labels: list[str], second_labels: list[str]
) -> list[Labels]:
    """Return pairs of labels that only one run has."""
    candidates = []
    for label, other in product(first_labels, second_labels):
        first_detector, second_detector = first_run.detectors[label], second_run.detectors[other]
        setting_names = first_detector.settings.keys() | second_detector.settings.keys()
        differing_settings = sum(
            first_detector.settings.get(name) != second_detector.settings.get(name) for name in setting_names
        )
        if first_detector.name == second_detector.name:
            candidates.append((differing_settings, first_labels.index(label), second_labels.index(other)))
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
