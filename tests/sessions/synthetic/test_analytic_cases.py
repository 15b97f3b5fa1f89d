from __future__ import annotations

import itertools

import numpy as np
import pytest

from sessions.synthetic import analytic_cases
from sessions.synthetic.analytic import ANALYTIC

BUILDERS = [getattr(analytic_cases, entry.split(":")[1]) for entry in ANALYTIC.values()]


@pytest.mark.parametrize("build", BUILDERS)
def test_a_higher_level_never_holds_less(build):
    case = build(np.random.default_rng(2), 6.0)
    for table in (case.contact, case.contained):
        for level in table.values():
            lengths = [sum(b - a for a, b in level(height)) for height in (-0.001, -0.0005, 0.0, 0.0005, 0.001)]
            assert all(a <= b + 1e-12 for a, b in itertools.pairwise(lengths))
            assert lengths[0] < lengths[-1]


@pytest.mark.parametrize("build", BUILDERS)
def test_paths_give_unit_quaternions_and_continuous_places(build):
    case = build(np.random.default_rng(2), 6.0)
    times = np.linspace(0.0, 6.0, 60_001)
    assert set(case.paths) == set(case.meshes)
    for path in case.paths.values():
        position, quaternion = path(times)
        np.testing.assert_allclose(np.linalg.norm(quaternion, axis=1), 1.0, atol=1e-12)
        assert np.linalg.norm(np.diff(position, axis=0), axis=1).max() < 5.0 * 1e-4


@pytest.mark.parametrize("build", BUILDERS)
def test_the_lever_reaches_every_surface_point_that_turns(build):
    case = build(np.random.default_rng(2), 6.0)
    moving = [name for name, path in case.paths.items() if len(np.unique(path(np.arange(5.0))[0], axis=0)) > 1]
    for name in moving:
        assert np.linalg.norm(case.meshes[name].vertices, axis=1).max() <= case.lever
