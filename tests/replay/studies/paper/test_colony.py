"""Near poses are split truly; every search reports only true contacts; each equation can be switched off."""

import pytest
from support.shapes import beaker_mesh, box_mesh, still

from cdcore import Body, Verdict, create_detector
from cdcore.search.search_settings import EQUATIONS
from replay.studies.paper import colony
from replay.studies.paper.colony import NearPoses, detected, near_poses

SIZES = [50, pytest.param(colony.TARGET, marks=pytest.mark.slow)]
"""Faces that meet, for which meshes are made: coarse ones in a tenth of a second, and those of the study."""


@pytest.fixture(scope="module", params=SIZES)
def poses(request):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(colony, "TARGET", request.param)
        yield near_poses("torus-sphere", 40)


@pytest.mark.slow
def test_an_independent_hierarchy_agrees_which_poses_collide(poses):
    detector = create_detector("obb", poses.bodies)
    assert (detector.detect(poses.colliding).verdict == Verdict.CONTACT).all()
    assert not (detector.detect(poses.free).verdict == Verdict.CONTACT).any()
    assert len(poses.colliding) + len(poses.free) == 40 and len(poses.free) > 2


@pytest.mark.parametrize("size", SIZES)
def test_the_bracket_closes_on_first_touch_from_both_sides(monkeypatch, size):
    for name, value in (("TARGET", size), ("DEEPER", 0.0), ("FARTHER", 0.0)):
        monkeypatch.setattr(colony, name, value)
    assert len(near_poses("torus-sphere", 20).free) == 0
    # Beyond the last bracket, reach / 2^16 or 1.5 um, nothing touches any more.
    monkeypatch.setattr(colony, "DEEPER", -1e-5)
    monkeypatch.setattr(colony, "FARTHER", 1e-5)
    assert len(near_poses("torus-sphere", 20).colliding) == 0


def test_what_a_collider_invents_in_free_poses_is_counted_as_false():
    bodies = (Body("beaker", beaker_mesh()), Body("rod", box_mesh((0.004, 0.004, 0.3))))
    through_the_floor, aside, inside = (still(bodies, [[0, 0, 0], [0, 0, z]]) for z in (0.1, 0.5, 0.2))
    assert detected(NearPoses("", bodies, through_the_floor, inside), "exact") == (1, 0, 0)
    assert detected(NearPoses("", bodies, through_the_floor, aside), "collider", shape="hull") == (1, 0, 0)
    assert detected(NearPoses("", bodies, through_the_floor, inside), "collider", shape="hull") == (1, 0, 1)


@pytest.mark.slow
def test_every_variant_and_equation_has_its_row_with_a_rate_in_its_interval(small):
    rates = small["F7e"]
    assert sum(rates.column("reported though free")) == 0
    for row in rates.rows:
        assert row[5] <= row[4] <= row[6] and row[3] == round(row[4] * row[2])
    ablation = small["ablation"]
    assert {row[2] for row in ablation.rows} == {"nothing", *(f"({number})" for number in EQUATIONS)}
    assert len({row[8] for row in ablation.rows}) > len(EQUATIONS)
