"""The pipeline read back: spheres, the funnel, sampled faces and best pairs are those of the run."""

from __future__ import annotations

import numpy as np
import pytest

from cdcore.bounding.sphere import sphere_best
from replay.outputs.palette import MISSED, SERIES, WHITE
from replay.outputs.rerun_log.columns import packed
from replay.outputs.rerun_log.recording import write_recording
from replay.outputs.watched_run import CONTACT, LOST, NEAR, watched_runs

LABEL = "paper"
END = {CONTACT: SERIES[2], LOST: MISSED, NEAR: WHITE}


@pytest.fixture(scope="module")
def run(taps):
    return taps(135, label=LABEL, name="hybrid-qaco", variant="corrected", budget=300)


@pytest.fixture(scope="module")
def watched(run):
    (one,) = watched_runs(run)
    return one


@pytest.fixture(scope="module")
def read(run, tmp_path_factory, reader):
    path = tmp_path_factory.mktemp("pipeline") / "run.rrd"
    write_recording(run, path)
    return reader(path)


def overlaps(assembly, column):
    """(T,) whether the balls of a pair meet, from their centres alone."""
    motion, balls, centres = assembly.motion, [], []
    for body in assembly.pairs[column].tolist():
        ball = sphere_best(assembly.bodies[body].mesh)
        balls.append(ball.radius)
        centres.append(motion.rotations[:, body] @ ball.centre + motion.translations[:, body])
    return np.linalg.norm(centres[0] - centres[1], axis=1) <= sum(balls)


def test_a_sphere_stands_exactly_while_it_overlaps_another(run, read):
    assembly = run.assembly
    valid = assembly.motion.valid
    meets = [overlaps(assembly, column) & valid[:, ends].all(axis=1) for column, ends in enumerate(assembly.pairs)]
    expected = {"beaker": meets[0], "rod": meets[0] | meets[1], "hand": meets[1]}
    assert not expected["hand"].all(), "the hand has no pose for a while"
    for name, truth in expected.items():
        shown = [
            len(read.at(f"world/{name}/sphere_of_{LABEL}", "Ellipsoids3D:half_sizes", t)) for t in range(len(valid))
        ]
        assert shown == truth.astype(int).tolist()
    assert not any(read.at(f"world/bench/sphere_of_{LABEL}", "Ellipsoids3D:half_sizes", 0)), "it holds the room"


def test_the_funnel_counts_what_the_run_counted(run, watched, read):
    detection = run.detections[LABEL]
    spheres = sum(
        (overlaps(run.assembly, column) & run.assembly.motion.valid[:, ends].all(axis=1)).astype(int)
        for column, ends in enumerate(run.assembly.pairs)
    )
    steps = {
        stage: f"pipeline/{LABEL}/pairs/{k}_{stage.replace(' ', chr(92) + ' ')}"
        for k, stage in enumerate(list(watched.counts)[1:])
    }
    told = {
        stage: [read.at(path, "Scalars:scalars", t)[0] for t in range(len(detection.times))]
        for stage, path in steps.items()
    }
    assert told["spheres meet"] == spheres.tolist()
    assert sum(told["spheres meet"]) == detection.work["box_tests"]
    assert sum(told["searched"]) == detection.work["looks"] > 0
    assert told["confirmed"] == (detection.verdict == 1).sum(axis=1).tolist()
    assert (np.array(told["boxes meet"]) <= told["spheres meet"]).all()


def test_a_look_stands_in_its_frame_alone_with_all_its_faces_and_ends_in_the_colour_of_its_verdict(run, watched, read):
    kinds = {moment.kind for moment in watched.moments}
    assert {CONTACT, LOST} <= kinds
    root, frames = f"pipeline/{LABEL}/search", {moment.frame for moment in watched.moments}
    for moment in watched.moments:
        trace = watched.trace(moment)
        there = read.at(f"{root}/faces", "Mesh3D:vertex_positions", moment.frame)
        assert len(there) == 3 * sum(len(np.unique(trace.faces[:, side])) for side in range(2))
        assert read.at(f"{root}/end", "Points3D:colors", moment.frame) == packed([END[moment.kind]]).tolist()
        assert len(read.at(f"{root}/best", "LineStrips3D:strips", moment.frame)[0]) == len(trace.best())
        if moment.frame + 1 not in frames and moment.frame + 1 < len(run.detections[LABEL].times):
            for part, component in (("faces", "Mesh3D:vertex_positions"), ("end", "Points3D:positions")):
                assert read.at(f"{root}/{part}", component, moment.frame + 1) == []


def test_the_confirmed_pair_lies_where_the_bodies_meet(run, watched, read):
    for moment in watched.moments:
        if moment.kind == CONTACT:
            section = run.detections["hybrid"].section(moment.frame, moment.pair).reshape(-1, 3)
            (end,) = read.at(f"pipeline/{LABEL}/search/end", "Points3D:positions", moment.frame)
            # The mean of two centroids: within a long face of the rod, and a centimetre towards the eye.
            assert np.linalg.norm(section - end, axis=1).min() < 0.11


def test_the_work_of_the_search_adds_up_to_what_the_run_counted(run, read):
    for name in ("evaluations", "iterations"):
        rows = read.column(f"pipeline/{LABEL}/work/{name}", "Scalars:scalars")
        assert sum(row[2][0] for row in rows) == run.detections[LABEL].work[name] > 0
        assert {0, 134} <= {row[1] for row in rows}


def test_a_detector_without_a_search_has_no_pipeline(demo):
    assert watched_runs(demo) == []
