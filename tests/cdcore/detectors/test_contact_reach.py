"""A detector reports contact up to its reach and no farther, asked at distances that are known."""

import pytest
from support.shapes import hulls_at

from cdcore import Verdict, create_detector
from cdcore.detectors.detector_table import detector_row

ENGINES = {"bullet": "pybullet", "mujoco": "mujoco"}


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize(
    ("name", "settings", "slack"),
    [
        ("collider", {"shape": "hull", "skin_m": 0.004}, 1e-6),
        ("collider", {"shape": "mesh", "skin_m": 0.001}, 1e-6),
        ("mujoco", {"margin_m": 0.005}, 1e-4),
        ("bullet", {"margin_m": 0.0}, 2e-4),
        ("bullet", {"margin_m": 0.001}, 2e-4),
        ("bullet", {"margin_m": 0.004}, 2e-4),
    ],
)
def test_contact_is_reported_below_the_reach_and_not_beyond(name, settings, slack, seed):
    """Convex hulls 0.3 times the reach apart, and ``slack`` metres within and beyond it."""
    if name in ENGINES:
        pytest.importorskip(ENGINES[name])
    bodies, _ = hulls_at(seed, [0.1])
    reach = create_detector(name, bodies, **settings).contact_reach(0)
    bodies, motion = hulls_at(seed, [0.3 * reach, reach - slack, reach + slack])
    verdict = create_detector(name, bodies, **settings).detect(motion).verdict[:, 0]
    assert (verdict == Verdict.CONTACT).tolist() == [True, True, False]


def test_detectors_without_a_contact_offset_reach_nowhere():
    """A contact offset is the distance from which a detector reports contact; these three report at 0 m."""
    bodies, _ = hulls_at(seed=0, gaps=[0.1])
    for name in ("exact", "discrete", "hybrid-qaco"):
        assert create_detector(name, bodies).contact_reach(0) == 0.0 and detector_row(name).contact_offset == ""
