"""Every attempt is refused or taken as it should by a sound detector, and the judge sees those that are not."""

import pytest

from replay.studies.stress import attempts
from replay.studies.stress.attempts import ATTEMPTS


@pytest.mark.parametrize("detector", ["exact", "hybrid"])
@pytest.mark.parametrize("number", ATTEMPTS)
def test_nothing_goes_wrong_with_a_sound_detector(number, detector):
    found = {name: attempt(detector) for name, attempt in ATTEMPTS[number][1]()}
    assert set(found.values()) == {""}
    assert len(found) >= 5


@pytest.mark.parametrize("number", [34, 36])
def test_an_engine_that_takes_everything_is_seen(number, monkeypatch):
    monkeypatch.setattr(attempts, "_matrix", lambda values: attempts.at([[0, 0, 0]]))
    found = {name: attempt("exact") for name, attempt in ATTEMPTS[number][1]()}
    assert "taken as if it were sound" in found.values()


def test_an_answer_that_depends_on_blocks_is_seen(monkeypatch):
    monkeypatch.setattr(attempts, "join", lambda parts: parts[0])
    found = {name: attempt("exact") for name, attempt in ATTEMPTS[43][1]()}
    assert found["blocks of 1"] == "another digest" and found["1 threads"] == ""
