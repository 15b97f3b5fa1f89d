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
"""Faces that meet where meshes overlap well: coarse ones, made in a tenth of a second, and those of the study."""


@pytest.fixture(scope="module", params=SIZES)
def near_poses_of_size(request):
    """40 poses of a torus and a ball a few millimetres about first touch: those that collide, and those that do not."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(colony, "TARGET_FACES", request.param)
        yield near_poses("torus-sphere", 40)


@pytest.mark.slow
def test_an_independent_hierarchy_agrees_which_poses_collide(near_poses_of_size):
    """40 poses of a torus and a ball about first touch, which either collide or are free.

    The detector ``obb``, a hierarchy of oriented boxes, meets faces in all poses that collide and in no free one.
    """
    colliding, free = near_poses_of_size.colliding, near_poses_of_size.free
    assert len(colliding) + len(free) == 40
    assert len(colliding) > 2 and len(free) > 2, "poses go 4 mm in and 2 mm out: about a third are free"
    detector = create_detector("obb", near_poses_of_size.bodies)
    assert (detector.detect(colliding).verdict == Verdict.CONTACT).all()
    assert not (detector.detect(free).verdict == Verdict.CONTACT).any()


@pytest.mark.parametrize("size", SIZES)
def test_the_bracket_closes_on_first_touch_from_both_sides(monkeypatch, size):
    """The distance of first touch is bisected 16 times from a bracket of 74 mm, which leaves 1.1 um.

    Poses go at most DEEPEST_M inwards from there and FARTHEST_M outwards: at 0 none is free, as the bracket ends on
    the side that collides; 10 um outwards none collides.
    """
    monkeypatch.setattr(colony, "TARGET_FACES", size)
    monkeypatch.setattr(colony, "DEEPEST_M", 0.0)
    monkeypatch.setattr(colony, "FARTHEST_M", 0.0)
    at_touch = near_poses("torus-sphere", 20)
    assert (len(at_touch.colliding), len(at_touch.free)) == (20, 0)
    monkeypatch.setattr(colony, "DEEPEST_M", -10e-6)
    monkeypatch.setattr(colony, "FARTHEST_M", 10e-6)
    outwards = near_poses("torus-sphere", 20)
    assert (len(outwards.colliding), len(outwards.free)) == (0, 20)


BEAKER_AND_ROD = (Body("beaker", beaker_mesh()), Body("rod", box_mesh((0.004, 0.004, 0.3))))
"""The middle of the rod, 30 cm long, is raised on Z above the middle of the beaker's floor."""


@pytest.mark.parametrize(
    ("height", "detector", "settings", "false"),
    [
        pytest.param(0.2, "exact", {}, 0, id="rod in the hollow, meshes"),
        pytest.param(0.5, "collider", {"shape": "hull"}, 0, id="rod above the beaker, hulls"),
        pytest.param(0.2, "collider", {"shape": "hull"}, 1, id="rod in the hollow, hulls"),
    ],
)
def test_collider_contacts_in_free_poses_count_as_false(height, detector, settings, false):
    """The rod touches nothing in the hollow of the beaker, though it is in the beaker's hull.

    The colliding pose is a rod through the floor, which every detector hits; only searches count evaluations.
    """
    through_the_floor, free = (motion_at_rest(BEAKER_AND_ROD, [[0, 0, 0], [0, 0, z]]) for z in (0.1, height))
    poses = NearPoses("any family", BEAKER_AND_ROD, colliding=through_the_floor, free=free)
    counts = count_detections(poses, detector, **settings)
    assert (counts.hits, counts.false, counts.evaluations) == ((1,), (false,), (0,))


def test_search_seeds_each_give_a_count(near_poses_of_size):
    """A search in poses of a torus near a ball, with seeds 3 and 4, counts what a search with each counts alone."""
    settings = {"variant": "corrected", "warm_start": False, "budget": 200}
    both, third, fourth = (
        count_detections(near_poses_of_size, "qaco", seeds, **settings) for seeds in ((3, 4), (3,), (4,))
    )
    assert both.hits == third.hits + fourth.hits
    assert both.evaluations == third.evaluations + fourth.evaluations


@pytest.mark.slow
def test_every_detector_has_a_rate_in_its_interval(tables_of_small_experiment):
    """Table F7e has a row a family and detector: of the poses that collide it detects so many, and no free pose."""
    rates = tables_of_small_experiment["F7e"]
    assert sum(rates.column("reported though free")) == 0
    assert rates.rows
    for row in rates.rows:
        measured = dict(zip(rates.head, row, strict=True))
        assert measured["low"] <= round(measured["detected"]) / measured["colliding"] <= measured["high"]
        assert measured["fewest"] <= measured["detected"] <= measured["most"]
        assert measured["rate"] == measured["detected"] / measured["colliding"]


@pytest.mark.slow
def test_every_equation_is_switched_off_in_turn(tables_of_small_experiment):
    """The table of the ablation has rows with every equation, and without each; they differ in evaluations."""
    ablation = tables_of_small_experiment["ablation"]
    assert {*ablation.column("without")} == {"nothing", *(f"({number})" for number in EQUATIONS)}
    assert len({*ablation.column("evaluations")}) > len(EQUATIONS)


def test_rows_count_mean_hits_and_evaluations_a_pose(monkeypatch):
    """10 of 14 poses collide and 4 are free; every search is planted to count the same with both its seeds.

    They hit 6 and 8 of 10 poses, 7 on average, with 100 and 300 evaluations, 20 a pose, and report 0 and 1 free pose.
    """
    seeds_of = {}

    def count(poses, name, seeds=(), **settings):
        seeds_of.setdefault(name, set()).add(tuple(seeds))
        return DetectionCounts(hits=(6, 8), false=(0, 1), evaluations=(100, 300))

    monkeypatch.setattr(colony, "near_poses", lambda *_: SimpleNamespace(colliding=[0] * 10, free=[0] * 4))
    monkeypatch.setattr(colony, "count_detections", count)
    rates, ablation = colony.colony_rows("torus", count=14, seed=5, search_seeds=2)
    colliding, detected, fewest, most, rate = 10, 7.0, 6, 8, 0.7
    hits = (colliding, detected, fewest, most, rate, *wilson_interval(7, 10))
    free, most_reported_though_free = 4, 1
    evaluations_a_pose, times_random_search = 20.0, 1.0
    assert rates[0] == ("torus", "exact", *hits, free, most_reported_though_free, None, None)
    searched = (evaluations_a_pose, times_random_search)
    assert rates[-1] == ("torus", "hybrid-qaco", *hits, free, most_reported_though_free, *searched)
    assert ablation[0] == ("torus", "memetic", "nothing", *hits, *searched)
    variants = ("memetic", "corrected")
    assert len(ablation) == len(variants) * (1 + len(EQUATIONS)), "with all equations, and without each in turn"
    assert seeds_of["qaco"] == seeds_of["hybrid-qaco"] == {(5, 6)}
    assert seeds_of["exact"] == {()}, "no search"


@pytest.mark.parametrize(("search_seeds", "text"), [(1, "with 1 seed:"), (2, "with 2 seeds:")])
def test_table_of_rates_states_its_search_seeds(search_seeds, text):
    """The first note says of how many seeds counts are means; the table has no rows here."""
    no_rows = ([], [])
    rates, _ablation = colony.colony_tables([no_rows], search_seeds)
    assert text in rates.notes[0]
