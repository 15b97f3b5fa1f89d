"""Engines get the same question and their answers are compared; cost grows below linearly in skipped frames."""

import numpy as np
import pytest

from replay.bench import race as module
from replay.bench.race import OwnExact, digest, grow, race
from replay.bench.workload import make_workload


@pytest.mark.parametrize("what", ["bool", "faces"])
def test_exact_agrees_with_python_fcl_and_there_are_contacts(what):
    fcl, exact = race(200, what, frames=900, repeats=1)
    assert fcl.speed == 1.0
    assert exact.wrong == 0
    assert exact.digest == fcl.digest
    assert exact.contacts > 0


def test_a_wrong_answer_is_counted(monkeypatch):
    class Liar(OwnExact):
        def ask(self, what):
            return 1 - super().ask(what)

    monkeypatch.setitem(module.ENGINES, "exact", Liar)
    _, exact = race(100, "bool", frames=50, repeats=1)
    assert exact.wrong == 50 * len(make_workload(100, 50).pairs)


def test_of_distant_bodies_every_pair_frame_is_skipped_and_no_block_is_examined():
    load = make_workload(200, 9_000)
    load.poses[:, :, 0, 3] += 5.0 * np.arange(7)
    work = OwnExact(load).detect("bool").work
    assert int(np.sum(work["skipped"])) == 9_000 * len(load.pairs)
    assert int(np.sum(work["blocks"])) == 0


def test_growth_says_how_much_was_asked_and_where_time_went():
    one = grow("frames", 400)
    assert one.pair_frames == 400 * len(make_workload(10, 1).pairs)
    assert one.work["skipped"] > 0
    assert 0 < sum(one.stages.values()) < 10 * one.seconds


def test_a_digest_depends_on_every_answer():
    assert digest(np.zeros((3, 2), int)) != digest(np.eye(3, 2, dtype=int))
