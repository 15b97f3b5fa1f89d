"""Peers see the same triangles; one that raises has refused, one that is absent is not asked."""

import numpy as np
import pytest

from cdcore import Verdict
from replay.stress import peers
from replay.stress.peers import PEERS, installed_peers, verdict_each

FLOOR = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
PAIRS = np.array(
    [
        [FLOOR, [[0.2, 0.2, -0.5], [0.3, 0.2, 0.5], [0.2, 0.3, 0.5]]],
        [FLOOR, [[0.2, 0.2, 0.1], [0.3, 0.2, 0.5], [0.2, 0.3, 0.5]]],
    ]
)


@pytest.mark.parametrize("name", PEERS)
def test_a_peer_is_right_where_nothing_is_hard(name):
    pytest.importorskip(name)
    assert PEERS[name](PAIRS).tolist() == [Verdict.CONTACT, Verdict.CLEAR]


def test_an_engine_that_raises_has_refused_that_pair():
    def meets(pair):
        if pair[1, 0, 2] > 0:
            raise RuntimeError("no")
        return True

    assert verdict_each(PAIRS, meets).tolist() == [Verdict.CONTACT, Verdict.INVALID]


def test_only_what_is_installed_is_asked(monkeypatch):
    monkeypatch.setattr(peers, "find_spec", lambda name: None if name == "coal" else object())
    assert installed_peers() == ["trimesh"]
