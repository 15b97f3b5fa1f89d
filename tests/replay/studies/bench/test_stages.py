"""Stages are told apart by trees that are cut: spheres stay as they are, faces are not asked."""

from types import SimpleNamespace

import numpy as np
import pytest

from cdcore.narrow.spacetime.box_tree import build_box_tree
from cdcore.narrow.spacetime.pair_job import Poses
from cdcore.narrow.spacetime.whole_motion import decide_motion
from replay.studies.bench import stages as module
from replay.studies.bench.stages import STAGES, root_only, stages, without_faces
from replay.studies.bench.workload import make_resting, make_workload


def asked(load, cut):
    trees = [cut(build_box_tree(vertices[faces])) for vertices, faces in load.meshes]
    turn, move = load.poses[..., :3, :3].copy(), load.poses[..., :3, 3].copy()
    return decide_motion(trees, load.pairs, Poses(turn, move, np.ones(move.shape[:2], dtype=bool)), faces=True)


def test_cut_trees_dismiss_the_same_by_spheres_and_ask_no_face():
    load = make_workload(200, 900)
    whole, hollow, roots = (asked(load, cut) for cut in (lambda tree: tree, without_faces, root_only))
    for name in ("skipped", "span_tests", "gap_tests", "blocks"):
        assert whole.work[name] == hollow.work[name] == roots.work[name] > 0
    assert whole.work["node_tests"] == hollow.work["node_tests"] > roots.work["node_tests"] == roots.work["blocks"]
    assert whole.work["face_tests"] > 0 == hollow.work["face_tests"] == roots.work["face_tests"]
    assert whole.hits.any() and not hollow.hits.any() and not roots.hits.any()


@pytest.mark.parametrize("what", ["bool", "faces"])
def test_every_stage_has_its_seconds_and_a_boolean_leaves_faces_within_trees(what):
    spent = stages("bench", make_workload(2_000, 900), what)
    assert set(STAGES) - set(spent.seconds) == (set() if what == "faces" else {"faces"})
    assert min(spent.seconds.values()) >= 0
    assert spent.seconds["check"] > 0 and spent.seconds["trees"] > 0


@pytest.mark.parametrize(("what", "parts"), [("bool", {"trees": 4.0}), ("faces", {"trees": 2.0, "faces": 2.0})])
def test_the_stages_of_a_search_add_up_to_it(what, parts, monkeypatch):
    def decided(trees, *_, **__):
        faces, nodes = trees[0].leaves[:, 1].any(), len(trees[0].boxes)
        seconds = {"poses": 0.5, "search": 1.0 if nodes == 1 else 5.0 if faces else 3.0, "exact": 0.1, "faces": 0.2}
        return SimpleNamespace(seconds=seconds)

    monkeypatch.setattr(module, "decide_motion", decided)
    spent = stages("bench", make_workload(200, 10), what).seconds
    del spent["check"]
    assert spent == {"poses": 0.5, "spheres": 1.0, "exact": 0.1, "sorting": 0.2, **parts}


def test_most_of_a_resting_contact_is_exact_arithmetic():
    spent = stages("resting", make_resting(500, 30), "faces").seconds
    assert spent["exact"] == max(spent.values())
