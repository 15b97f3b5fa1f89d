from small_worlds import cubes

from replay.engine import compute

BUMP = {"a": [0] * 12, "b": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3]}


def test_every_numbered_miss_has_a_cause_and_the_causes_are_those_counted():
    result = compute(cubes(BUMP), detectors="slow=discrete[rate_hz=20],hybrid")
    assert [miss.cause for miss in result.misses["slow"]] == ["between looks", "between looks"]
    assert result.causes["slow"].missed == result.causes["slow"].examined == 3
    assert result.misses["hybrid"] == () and result.causes["hybrid"].of_misses == ()


def test_misses_beside_an_oracle_without_faces_are_looked_at_with_an_exact_detector():
    result = compute(cubes(BUMP), detectors="slow=discrete[rate_hz=20]", oracle="planted_detectors:Planted")
    assert [miss.cause for miss in result.misses["slow"]] == ["between looks"] * 2
    assert all(miss.face_pairs for miss in result.misses["slow"])
