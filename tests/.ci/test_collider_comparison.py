"""Advised colliders against those that others ship: planted motions have contacts, and two rows of the table hold."""

import pytest
from support.processes import script

from replay.advice import collider_search

command = script("collider_comparison")


@pytest.mark.parametrize("name", command.CASES)
def test_planted_touches_of_the_comparison_touch_a_closed_mesh(name):
    """At its first contact a probe of spheres is as far from the surface as its radius."""
    case = command.CASES[name]()
    mesh = command.as_mesh(case.mesh)
    surface = command.Surface(mesh.triangles)
    assert mesh.is_closed
    for touch in case.touches:
        middles, radius = command.spheres(touch.probe)
        position = command.first_contact(surface, touch)
        assert float(surface.distances(position + middles)[0].min()) == pytest.approx(radius, abs=1e-6)


def test_outcome_is_less_worse_or_a_tie():
    """Ours has 0.1 false and nothing missed; it is worse where either figure is larger by more than 0.001."""
    outcome = command.Outcome
    ours = outcome(8, 0.1, 0.0)
    for false, missed, verdict in (
        (0.2, 0.0, "less"),
        (0.1, 0.2, "less"),
        (0.1005, 0.0, "tie"),
        (0.0, 0.5, "worse"),
        (0.5, 0.0, "less"),
    ):
        assert command.Row("a-8", {"other": outcome(8, false, missed)}, ours).verdict == verdict


@pytest.mark.slow
@pytest.mark.parametrize("name", ["rack-16", "mug-8"])
def test_advised_pieces_are_better_than_those_that_others_ship(name, tmp_path, monkeypatch):
    """The search is left without V-HACD and CoACD of its own, which take a minute and change neither row."""
    monkeypatch.setattr(collider_search, "OTHER_METHODS", ())
    (row,) = command.compared([name], tmp_path)
    assert row.verdict == "less", row.text
    assert row.ours.pieces <= min(other.pieces for other in row.others.values())
