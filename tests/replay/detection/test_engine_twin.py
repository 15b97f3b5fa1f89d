"""An engine answers rows of `tradeoff --engine` as its re-creation does, but near where contact begins."""

import pytest

from cdcore.detectors import ENGINE_MODULE
from replay.detection.detector_spec import parse_detector
from replay.detection.engine_twin import compare_twins, engine_twin
from replay.prepare.assemble import assemble
from replay.tradeoffs.engine_knobs import ENGINES
from sessions.synthetic.scenes import make_scene_session

HULLS = "collider[shape=hull,skin_m={}]"


def unity_rows():
    """Rows of Unity that PhysX can check, as rows about whole hulls, with the rows of PhysX."""
    asked = [choice.asked(90.0) for choice in ENGINES["unity"].choices]
    twins = [(row, engine_twin("physx", row)) for row in asked]
    return [(row.replace("shape=compound,pieces=1", "shape=hull"), twin) for row, twin in twins if twin]


@pytest.fixture(scope="module")
def demo():
    session = make_scene_session("bench-bumps")[0]
    first = int(session.frames.stamp_ns[0])
    return assemble(session.between(first + 10 * 10**9, first + 14 * 10**9))


@pytest.mark.parametrize(
    ("engine", "asked"),
    [
        ("physx", "collider[shape=hull,rate_hz=50]"), ("physx", "collider[shape=compound,pieces=16,skin_m=0.01]"),
        ("rapier", "collider[shape=capsule]"), ("bullet", "exact"), ("physx", "collider[shape=shipped,skin_m=0.01]"),
    ],
)  # fmt: skip
def test_what_an_engine_cannot_be_asked_has_no_twin(engine, asked):
    assert engine_twin(engine, asked) is None


def test_a_twin_has_the_shape_the_step_and_the_offset_of_its_row():
    asked = parse_detector(engine_twin("physx", "collider[shape=compound,pieces=1,rate_hz=50,skin_m=0.01]"))
    assert (asked.name, asked.settings) == ("physx", {"shape": "hull", "rate_hz": 50.0, "contact_offset_m": 0.01})
    assert parse_detector(engine_twin("rapier", "collider[skin_m=0.01]")).settings["prediction_m"] == 0.02
    assert parse_detector(engine_twin("bullet", "collider[shape=mesh]")).settings == {"shape": "mesh", "margin_m": 0.0}


@pytest.mark.parametrize(("engine", "skin", "early", "late"), [("rapier", 0.01, 0.0, 3.0), ("bullet", 0.001, 4.0, 0.0)])
def test_an_engine_and_its_re_creation_differ_only_where_contact_begins(engine, skin, early, late, demo):
    pytest.importorskip(ENGINE_MODULE[engine])
    row = HULLS.format(skin)
    counts = compare_twins(demo, engine_twin(engine, row), row)
    posed = int(demo.motion.valid[:, demo.pairs].all(axis=2).sum())
    assert counts.equal + counts.engine_only + counts.ours_only == posed and counts.both > 100
    assert counts.equal / posed > 0.999 and counts.not_supported == 0
    if counts.gaps_mm is not None:
        begin = 2000 * skin
        assert begin - late <= counts.gaps_mm[0] and counts.gaps_mm[1] <= begin + early


def test_pair_frames_that_an_engine_cannot_test_are_not_supported_and_no_difference(demo):
    pytest.importorskip("pybullet")
    row = "collider[shape=mesh,skin_m=0.001]"
    counts = compare_twins(demo, engine_twin("bullet", row), row)
    assert counts.not_supported > 1000 and counts.ours_only == 0
    posed = int(demo.motion.valid[:, demo.pairs].all(axis=2).sum())
    assert counts.equal + counts.engine_only + counts.not_supported == posed


@pytest.mark.slow
@pytest.mark.parametrize(("row", "twin"), unity_rows())
def test_physx_answers_a_row_of_unity_as_the_row_does(row, twin, demo):
    pytest.importorskip("ovphysx")
    counts = compare_twins(demo, twin, row)
    assert counts.both > 100 and counts.engine_only + counts.ours_only < 0.001 * counts.equal


def test_some_rows_of_unity_can_be_checked():
    assert len(unity_rows()) >= 3
