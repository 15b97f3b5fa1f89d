"""Made-up sessions by name and seed."""

from replay.studies.synthetic_sessions import made_up_names, synthetic_session


def test_an_analytic_session_is_made_by_its_name_and_seed():
    """Equal positions from one seed, others from another."""
    assert "fast-ball" in made_up_names()
    item, same, other = (synthetic_session("fast-ball", seed=seed)[0] for seed in (1, 1, 2))
    assert item.frames.position.tobytes() == same.frames.position.tobytes()
    assert item.frames.position.tobytes() != other.frames.position.tobytes()
