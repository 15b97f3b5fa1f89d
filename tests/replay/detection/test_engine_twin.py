"""An engine answers as its re-creation does, but near where contact begins."""

import pytest

from cdcore.detectors import ENGINE_MODULE
from replay.detection.engine_twin import compare_twins
from replay.prepare.assemble import assemble
from sessions.synthetic.scenes import make_scene_session


@pytest.fixture(scope="module")
def demo():
    session = make_scene_session("bench-bumps")[0]
    first = int(session.frames.stamp_ns[0])
    return assemble(session.between(first + 10 * 10**9, first + 14 * 10**9))


@pytest.mark.parametrize(
    ("twin", "skin", "early", "late"),
    [
        ("rapier[prediction_m=0.02]", 0.01, 0.0, 3.0),
        ("bullet[margin_m=0.001]", 0.001, 4.0, 0.0),
        pytest.param("physx[contact_offset_m=0.01]", 0.01, 1.0, 1.0, marks=pytest.mark.slow),
    ],
)
def test_an_engine_and_its_re_creation_differ_only_where_contact_begins(twin, skin, early, late, demo):
    pytest.importorskip(ENGINE_MODULE[twin.partition("[")[0]])
    counts = compare_twins(demo, twin, f"collider[shape=hull,skin_m={skin}]")
    posed = int(demo.motion.valid[:, demo.pairs].all(axis=2).sum())
    assert counts.equal + counts.engine_only + counts.ours_only == posed and counts.both > 100
    assert counts.equal / posed > 0.999 and counts.not_supported == 0
    if counts.gaps_mm is not None:
        begin = 2000 * skin
        assert begin - late <= counts.gaps_mm[0] and counts.gaps_mm[1] <= begin + early


def test_pair_frames_that_an_engine_cannot_test_are_not_supported_and_no_difference(demo):
    pytest.importorskip("pybullet")
    counts = compare_twins(demo, "bullet[shape=mesh,margin_m=0.001]", "collider[shape=mesh,skin_m=0.001]")
    assert counts.not_supported > 1000 and counts.ours_only == 0
    posed = int(demo.motion.valid[:, demo.pairs].all(axis=2).sum())
    assert counts.equal + counts.engine_only + counts.not_supported == posed
