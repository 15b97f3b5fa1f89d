"""Every failure ever found is asked again: exact is right on all cases in ``regressions/``, two algorithms agreeing."""

from pathlib import Path

import numpy as np
import pytest
from oracles.separating_axes import meets_by_axes

from cdcore import Verdict
from cdcore.narrow.triangles.predicates import triangles_intersect
from replay.studies.stress.cases import read_cases
from replay.studies.stress.peers import verdicts_of

FILES = sorted((Path(__file__).parent / "regressions").glob("*.npz"))


def test_there_are_cases():
    assert FILES


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_case_that_failed_somewhere_is_right_here(path):
    cases = read_cases(path)
    assert np.array_equal([meets_by_axes(pair) for pair in cases.triangles], cases.truth)
    assert np.array_equal(triangles_intersect(cases.triangles), cases.truth)
    assert np.array_equal(verdicts_of("exact", cases.triangles) == Verdict.CONTACT, cases.truth)
    assert len(cases.row) > 0
