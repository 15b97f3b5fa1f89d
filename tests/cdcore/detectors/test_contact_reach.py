"""A detector reports contact up to its reach and no farther, asked at distances that are known."""

import pytest
from support.shapes import hulls_at

from cdcore import Verdict, create_detector
from cdcore.detectors.detector_table import detector_row

FIRST_PAIR = 0
ENGINES = {"bullet": "pybullet", "mujoco": "mujoco"}


@pytest.mark.parametrize(
    ("name", "settings", "error_m"),
    [
        pytest.param("collider", {"shape": "hull", "skin_m": 0.004}, 1e-6, id="hulls with skins of 4 mm"),
        pytest.param("collider", {"shape": "mesh", "skin_m": 0.001}, 1e-6, id="meshes with skins of 1 mm"),
        pytest.param("mujoco", {"margin_m": 0.005}, 1e-4, id="MuJoCo, 5 mm"),
        pytest.param("bullet", {"margin_m": 0.0}, 2e-4, id="Bullet, 0 mm"),
        pytest.param("bullet", {"margin_m": 0.001}, 2e-4, id="Bullet, 1 mm"),
        pytest.param("bullet", {"margin_m": 0.004}, 2e-4, id="Bullet, 4 mm"),
    ],
)
def test_contact_is_reported_below_the_reach_and_not_beyond(name, settings, error_m):
    """``contact_reach`` says from which distance a detector reports contact; ``error_m``: how far it may be off.

    Two random convex hulls stand at 0.3 of that distance, and by ``error_m`` within it and beyond it.
    """
    if name in ENGINES:
        pytest.importorskip(ENGINES[name])
    bodies, _motion = hulls_at(seed=0, gaps=[0.1])  # the same bodies at any gap
    reach = create_detector(name, bodies, **settings).contact_reach(FIRST_PAIR)
    bodies, motion = hulls_at(seed=0, gaps=[0.3 * reach, reach - error_m, reach + error_m])
    verdict = create_detector(name, bodies, **settings).detect(motion).verdict[:, 0]
    assert (verdict == Verdict.CONTACT).tolist() == [True, True, False]


@pytest.mark.parametrize("name", ["exact", "discrete", "hybrid-qaco"])
def test_detectors_without_a_contact_offset_reach_nowhere(name):
    """A contact offset is a setting: the distance from which contact is reported; without one it is reported at 0 m."""
    bodies, _motion = hulls_at(seed=0, gaps=[0.1])
    assert create_detector(name, bodies).contact_reach(FIRST_PAIR) == 0.0
    assert detector_row(name).contact_offset == "", "the name of the setting"
