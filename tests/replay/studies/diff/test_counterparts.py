"""Detectors of two runs are compared by label, as references, or as the most similar settings of one detector."""

from types import SimpleNamespace

import pytest

from replay.errors import RunFolderError
from replay.studies.diff.counterparts import matching_labels

SLOW, FAST = {"rate_hz": 50, "hold": True}, {"rate_hz": 100, "hold": True}


def a_run(oracle="exact", **detectors):
    """A run with these detectors: label -> name, or name and settings."""
    rows = {label: (row, {}) if isinstance(row, str) else row for label, row in detectors.items()}
    documents = {label: SimpleNamespace(name=name, settings=settings) for label, (name, settings) in rows.items()}
    return SimpleNamespace(detectors=documents, oracle=oracle)


@pytest.mark.parametrize(
    ("first", "second", "pairs"),
    [
        (a_run(exact="exact", a="obb"), a_run(a="sphere", exact="exact"), ["exact exact", "a a"]),
        (a_run(exact="exact"), a_run("truth", truth="hybrid"), ["exact truth"]),
        (a_run(oracle=None, fast=("d", FAST), slow=("d", SLOW)), a_run(oracle=None, other=("d", SLOW)), ["slow other"]),
        (a_run(oracle=None, x=("d", SLOW)), a_run(oracle=None, y=("d", FAST), z=("d", SLOW)), ["x z"]),
        (a_run(oracle=None, x="obb", y="aabb"), a_run(oracle=None, z="aabb", w="obb"), ["x w", "y z"]),
        (a_run(oracle=None, mine="sphere"), a_run(oracle=None, wide="aabb"), ["mine wide"]),
        (a_run(oracle=None, mine="sphere", other="obb"), a_run(oracle=None, wide="aabb"), []),
        (a_run(exact="exact", mine="obb"), a_run(exact="exact", mine="obb", new="aabb"), ["exact exact", "mine mine"]),
    ],
    ids=["labels", "references", "same settings", "least change", "one row", "last ones", "two and one", "new one"],
)
def test_detectors_are_compared_with_their_counterparts(first, second, pairs):
    """``pairs``: labels of the first and of the second run; a run's first argument is its reference."""
    assert [" ".join(labels) for labels in matching_labels(first, second)] == pairs


def test_chosen_pairs_replace_equal_labels():
    """Both runs have a and b, and a is to be compared with b: then b is compared with a."""
    first, second = a_run(oracle=None, a="obb", b="aabb"), a_run(oracle=None, a="obb", b="aabb")
    assert matching_labels(first, second, [("a", "b")]) == [("a", "b"), ("b", "a")]
    for pair in (("x", "b"), ("a", "x")):
        with pytest.raises(RunFolderError, match="no detector 'x'; there are: a, b"):
            matching_labels(first, second, [pair])
