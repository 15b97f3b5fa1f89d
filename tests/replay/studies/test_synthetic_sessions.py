"""Made-up sessions by name and seed."""

from replay.studies.synthetic_sessions import made_up_names, synthetic_session


def test_an_analytic_session_is_made_by_its_name_and_seed():
    """``fast-ball`` is a made-up session: equal positions from the same seed, others from another."""
    assert "fast-ball" in made_up_names()
    session, _truth = synthetic_session("fast-ball", seed=1)
    again, _truth = synthetic_session("fast-ball", seed=1)
    other, _truth = synthetic_session("fast-ball", seed=2)
    assert session.frames.position.tobytes() == again.frames.position.tobytes()
    assert session.frames.position.tobytes() != other.frames.position.tobytes()
