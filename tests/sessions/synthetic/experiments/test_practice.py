import numpy as np

from sessions.synthetic.experiments.practice import make_practice


def test_a_session_holds_the_touches_and_near_misses_that_were_asked_for():
    session, truth = make_practice((0.02, 0.25), 3, pseudonym="S09", seed=2, noise="off")
    lengths = [episode.nominal[1] - episode.nominal[0] for episode in truth.episodes if episode.kind == "contact"]
    assert np.allclose(lengths, [0.02, 0.25], atol=1e-6)
    assert len([fact for fact in truth.facts if fact.kind == "near_miss"]) == 3
    assert session.facts["pseudonym"] == "S09"


def test_a_careful_student_touches_nothing():
    _, truth = make_practice(seed=4)
    assert [episode for episode in truth.episodes if episode.nominal] == []
    assert len([fact for fact in truth.facts if fact.kind == "grasp"]) == 1


def test_the_same_arguments_give_the_same_session():
    one, other = (make_practice((0.1,), 1, seed=6)[0] for _ in range(2))
    assert one.names == other.names
    for a, b in zip(one.source.blocks(4096), other.source.blocks(4096), strict=True):
        assert np.array_equal(a.position, b.position, equal_nan=True)
