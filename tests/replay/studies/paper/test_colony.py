"""Near poses are split truly; every search reports only true contacts; each equation can be switched off."""

from types import SimpleNamespace

import pytest
from support.shapes import beaker_mesh, box_mesh, motion_at_rest

from cdcore import Body, Verdict, create_detector
from cdcore.search.search_settings import EQUATIONS
from replay.auditing.wilson import wilson_interval
from replay.studies.paper import colony
from replay.studies.paper.colony import DetectionCounts, NearPoses, count_detections, near_poses

SIZES = [50, pytest.param(colony.TARGET_FACES, marks=pytest.mark.slow)]
"""Faces that meet, for which meshes are made: coarse ones in a tenth of a second, and those of the study."""


@pytest.fixture(scope="module", params=SIZES)
def near_poses_of_size(request):
    """Poses of a torus near a ball, for meshes of each size."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(colony, "TARGET_FACES", request.param)
        yield near_poses("torus-sphere", 40)


@pytest.mark.slow
def test_an_independent_hierarchy_agrees_which_poses_collide(near_poses_of_size):
    """The detector ``obb`` tests all poses; of 40 more than two are free."""
    detector = create_detector("obb", near_poses_of_size.bodies)
    assert (detector.detect(near_poses_of_size.colliding).verdict == Verdict.CONTACT).all()
    assert not (detector.detect(near_poses_of_size.free).verdict == Verdict.CONTACT).any()
    assert len(near_poses_of_size.colliding) + len(near_poses_of_size.free) == 40 and len(near_poses_of_size.free) > 2


@pytest.mark.parametrize("size", SIZES)
def test_the_bracket_closes_on_first_touch_from_both_sides(monkeypatch, size):
    """Poses are as deep or far as DEEPEST_M and FARTHEST_M allow: at 0 none is free, 10 um away none collides.

    The last bracket is 1.5 um wide, reach / 2^16.
    """
    for name, value in (("TARGET_FACES", size), ("DEEPEST_M", 0.0), ("FARTHEST_M", 0.0)):
        monkeypatch.setattr(colony, name, value)
    assert len(near_poses("torus-sphere", 20).free) == 0
    monkeypatch.setattr(colony, "DEEPEST_M", -1e-5)
    monkeypatch.setattr(colony, "FARTHEST_M", 1e-5)
    assert len(near_poses("torus-sphere", 20).colliding) == 0


def test_collider_contacts_in_free_poses_count_as_false():
    """The rod stands in the hollow of the beaker (free, but in its hull), above it, or through its floor."""
    bodies = (Body("beaker", beaker_mesh()), Body("rod", box_mesh((0.004, 0.004, 0.3))))
    through_the_floor, aside, inside = (motion_at_rest(bodies, [[0, 0, 0], [0, 0, z]]) for z in (0.1, 0.5, 0.2))
    for free, detector, settings, false in (
        (inside, "exact", {}, 0),
        (aside, "collider", {"shape": "hull"}, 0),
        (inside, "collider", {"shape": "hull"}, 1),
    ):
        answers = count_detections(NearPoses("", bodies, through_the_floor, free), detector, **settings)
        assert (answers.hits, answers.false, answers.evaluations) == ((1,), (false,), (0,))


def test_search_seeds_each_give_a_count(near_poses_of_size):
    """Two seeds together count what each counts alone."""
    both = count_detections(near_poses_of_size, "qaco", (3, 4), variant="corrected", warm_start=False, budget=200)
    alone = [
        count_detections(near_poses_of_size, "qaco", (seed,), variant="corrected", warm_start=False, budget=200)
        for seed in (3, 4)
    ]
    assert both.hits == tuple(answers.hits[0] for answers in alone)
    assert both.evaluations == tuple(answers.evaluations[0] for answers in alone)


@pytest.mark.slow
def test_every_variant_and_equation_has_a_rate_in_its_interval(small):
    """No search reports a free pose; without each equation in turn the work differs."""
    rates = small["F7e"]
    assert sum(rates.column("reported though free")) == 0
    for row in rates.rows:
        measured = dict(zip(rates.head, row, strict=True))
        assert measured["low"] <= round(measured["detected"]) / measured["colliding"] <= measured["high"]
        assert measured["fewest"] <= measured["detected"] <= measured["most"]
        assert measured["rate"] == measured["detected"] / measured["colliding"]
    ablation = small["ablation"]
    assert {without for _family, _variant, without, *_ in ablation.rows} == {
        "nothing",
        *(f"({number})" for number in EQUATIONS),
    }
    assert len(set(ablation.column("evaluations"))) > len(EQUATIONS)


def test_rows_count_mean_hits_and_evaluations_a_pose(monkeypatch):
    """Two search seeds hit 6 and 8 of 10 poses and report 0 and 1 of 4 free ones, with 100 and 300 evaluations.

    Of free poses the row has the most that a seed reported, 1. A mean of 200 evaluations is 20 for each of 10 poses,
    and 1.0 times those of the random search, which counts the same here.
    """
    searched = []

    def count(poses, name, seeds=(), **settings):
        searched.append((name, tuple(seeds)))
        return DetectionCounts((6, 8), (0, 1), (100, 300))

    monkeypatch.setattr(colony, "near_poses", lambda *_: SimpleNamespace(colliding=[0] * 10, free=[0] * 4))
    monkeypatch.setattr(colony, "count_detections", count)
    rates, ablation = colony.colony_rows("torus", 14, seed=5, search_seeds=2)
    assert {seeds for name, seeds in searched if "qaco" in name} == {(5, 6)}
    assert {seeds for name, seeds in searched if "qaco" not in name} == {()}
    hits = (10, 7.0, 6, 8, 0.7, *wilson_interval(7, 10))
    assert rates[0] == ("torus", "exact", *hits, 4, 1, None, None)
    assert rates[-1] == ("torus", "hybrid-qaco", *hits, 4, 1, 20.0, 1.0)
    assert ablation[0] == ("torus", "memetic", "nothing", *hits, 20.0, 1.0)
    # Memetic and corrected, each with all equations and without each of them in turn.
    assert len(ablation) == 2 * (1 + len(EQUATIONS))


@pytest.mark.parametrize(("seeds", "text"), [(1, "with 1 seed:"), (2, "with 2 seeds:")])
def test_table_of_rates_states_its_search_seeds(seeds, text):
    """The table has no rows; its first note says of how many seeds counts are means."""
    rates, _ = colony.colony_tables([([], [])], seeds)
    assert text in rates.notes[0]
