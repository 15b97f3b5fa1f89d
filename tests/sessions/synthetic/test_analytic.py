import numpy as np
import pytest
from support.analytic_cases import ANALYTIC


@pytest.mark.parametrize("build", ANALYTIC.values(), ids=ANALYTIC)
def test_the_lever_reaches_every_surface_point_that_turns(build):
    case = build(np.random.default_rng(2), 6.0)
    moving = [name for name, path in case.paths.items() if len(np.unique(path(np.arange(5.0))[0], axis=0)) > 1]
    for name in moving:
        assert np.linalg.norm(case.meshes[name].vertices, axis=1).max() <= case.lever
