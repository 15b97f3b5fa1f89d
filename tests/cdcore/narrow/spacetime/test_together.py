"""All pairs at once keep the distance that each keeps alone."""

import numpy as np
from support.motions import rotations, soup

from cdcore.narrow.spacetime.box_tree import build_box_tree
from cdcore.narrow.spacetime.pair_job import PairJob, Poses
from cdcore.narrow.spacetime.pose_lanes import Tracks, ends_of
from cdcore.narrow.spacetime.together import search_together
from cdcore.narrow.spacetime.traverse import Workspace


def test_each_pair_keeps_the_pad_of_both_bodies_their_places_and_their_skew(monkeypatch):
    rng, pairs = np.random.default_rng(0), np.array([[0, 1], [2, 0], [1, 2]])
    trees = [build_box_tree(soup(rng, 12) * scale) for scale in (1.0, 5.0, 30.0)]
    turn = rotations(rng, (20, 3)) * (1.0 + 1e-10 * np.array([1.0, 3.0, 9.0]))[:, None, None]
    move = rng.normal(size=(20, 3, 3)) * np.array([1.0, 20.0, 300.0])[:, None]
    tracks = Tracks(turn, move, np.arange(3), np.arange(20), ends_of(trees))
    kept = []
    monkeypatch.setattr(Workspace, "traverse_all", lambda _self, _rows, pads, _settle: kept.extend(pads) or iter(()))
    columns, _ = search_together(
        trees,
        pairs,
        tracks,
        False,
        Workspace(),
        lambda _column, keys: keys,
        np.zeros((3, 2, 20), dtype=np.uint8),
        np.zeros(20, dtype=np.int64),
    )
    poses = Poses(turn, move, np.ones((20, 3), dtype=bool))
    alone = [PairJob(trees, i, j, poses, [None] * 3, faces=False)._pad for i, j in pairs.tolist()]
    assert columns.tolist() == [0, 1, 2]
    np.testing.assert_allclose(kept, alone, rtol=1e-12)
