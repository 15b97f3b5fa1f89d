"""Detectors of two runs are compared by label, as references, or as the most similar settings of one detector."""

from types import SimpleNamespace

import pytest

from replay.errors import RunFolderError
from replay.studies.diff.counterparts import matching_labels

SLOW, FAST = {"rate_hz": 50, "hold": True}, {"rate_hz": 100, "hold": True}
"""Settings of a detector."""


def a_run(reference=None, **detectors):
    """A run with these detectors: label -> name of the detector, or its name and settings."""
    rows = {label: (row, {}) if isinstance(row, str) else row for label, row in detectors.items()}
    documents = {label: SimpleNamespace(name=name, settings=settings) for label, (name, settings) in rows.items()}
    return SimpleNamespace(detectors=documents, oracle=reference)


@pytest.mark.parametrize(
    ("first", "second", "pairs"),
    [
        pytest.param(
            a_run("exact", exact="exact", a="obb"),
            a_run("exact", a="sphere", exact="exact"),
            [("exact", "exact"), ("a", "a")],
            id="equal labels, in the order of the first run",
        ),
        pytest.param(
            a_run("exact", exact="exact"), a_run("truth", truth="hybrid"), [("exact", "truth")], id="both references"
        ),
        pytest.param(
            a_run(fast=("discrete", FAST), slow=("discrete", SLOW)),
            a_run(other=("discrete", SLOW)),
            [("slow", "other")],
            id="same detector and settings",
        ),
        pytest.param(
            a_run(x=("discrete", SLOW)),
            a_run(y=("discrete", FAST), z=("discrete", SLOW)),
            [("x", "z")],
            id="fewest settings that differ",
        ),
        pytest.param(a_run(x="obb", y="aabb"), a_run(z="aabb", w="obb"), [("x", "w"), ("y", "z")], id="same detector"),
        pytest.param(a_run(mine="sphere"), a_run(wide="aabb"), [("mine", "wide")], id="the only ones left"),
        pytest.param(a_run(mine="sphere", other="obb"), a_run(wide="aabb"), [], id="two left of one run"),
        pytest.param(
            a_run("exact", exact="exact", mine="obb"),
            a_run("exact", exact="exact", mine="obb", new="aabb"),
            [("exact", "exact"), ("mine", "mine")],
            id="one left without a counterpart",
        ),
    ],
)
def test_detectors_are_compared_with_their_counterparts(first, second, pairs):
    """Detectors of two runs, with name and settings; ``pairs``: labels of the first and of the second run.

    SLOW and FAST are settings that differ in one number, the rate.
    """
    assert matching_labels(first, second) == pairs


def test_chosen_pairs_replace_equal_labels():
    """Both runs have a and b, and a is to be compared with b: then the only ones left, b and a, are compared."""
    first, second = a_run(a="obb", b="aabb"), a_run(a="obb", b="aabb")
    assert matching_labels(first, second, chosen_pairs=[("a", "b")]) == [("a", "b"), ("b", "a")]


@pytest.mark.parametrize("pair", [("x", "b"), ("a", "x")])
def test_chosen_label_that_a_run_has_not_is_refused(pair):
    """Both runs have a and b; x is in neither."""
    with pytest.raises(RunFolderError, match="no detector 'x'; there are: a, b"):
        matching_labels(a_run(a="obb", b="aabb"), a_run(a="obb", b="aabb"), chosen_pairs=[pair])
