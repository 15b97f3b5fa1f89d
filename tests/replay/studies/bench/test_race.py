"""Engines get the same question, their answers are compared, and what differs is counted."""

import numpy as np
import pytest

from replay.studies.bench import race as module
from replay.studies.bench.engines import OwnExact
from replay.studies.bench.race import digest, race
from replay.studies.bench.workload import make_workload


@pytest.fixture(autouse=True)
def two_engines(monkeypatch):
    monkeypatch.setattr(module, "installed_engines", lambda: ["python-fcl", "exact"])


@pytest.mark.parametrize("what", ["bool", "faces"])
def test_exact_agrees_with_python_fcl_and_there_are_contacts(what):
    fcl, exact = race(200, what, frames=900, repeats=1)
    assert fcl.speed == 1.0
    assert exact.wrong == 0
    assert exact.digest == fcl.digest
    assert exact.contacts > 0
    assert min(fcl.build, exact.build) > 0


def test_a_wrong_answer_is_counted(monkeypatch):
    class Liar(OwnExact):
        def ask(self, what):
            return 1 - super().ask(what)

    monkeypatch.setitem(module.ENGINES, "exact", Liar)
    _, exact = race(100, "bool", frames=50, repeats=1)
    assert exact.wrong == 50 * len(make_workload(100, 50).pairs)


def test_a_peer_that_needs_long_is_asked_once_and_what_is_compared_is_asked_again(monkeypatch):
    asked = []

    class Counted(OwnExact):
        def ask(self, what):
            asked.append(self)
            return super().ask(what)

    monkeypatch.setattr(module, "installed_engines", lambda: ["python-fcl", "coal", "exact"])
    for name in ("coal", "exact"):
        monkeypatch.setitem(module.ENGINES, name, Counted)
    monkeypatch.setattr(module, "PATIENCE", 0.0)
    fcl, slow, exact = race(100, "bool", frames=50, repeats=3)
    assert asked == [*dict.fromkeys(asked), *asked[1:2] * 3], "coal once, exact three times more"
    assert min(fcl.seconds, slow.seconds, exact.seconds) > 0 and np.isfinite(slow.speed)


def test_a_digest_depends_on_every_answer():
    assert digest(np.zeros((3, 2), int)) != digest(np.eye(3, 2, dtype=int))
