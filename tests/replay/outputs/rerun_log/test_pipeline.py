"""The pipeline read back: the funnel, volumes, sampled faces and best pairs are those of the run."""

from __future__ import annotations

import numpy as np
import pytest

from cdcore.bounding.bounding_sphere import sphere_best
from cdcore.bounding.box import box_best
from cdcore.transforms.rigid import rotation_from_quaternion
from replay.outputs.palette import MISSED, SERIES
from replay.outputs.rerun_log.pipeline_view import FOUND, LOST, search_runs
from replay.outputs.rerun_log.recording_file import packed

LABEL = "paper"
ROOT = f"pipeline/{LABEL}"


@pytest.fixture(scope="module")
def run(taps):
    return taps(135, label=LABEL, name="hybrid-qaco", variant="corrected", budget=300)


@pytest.fixture(scope="module")
def watched(run):
    (one,) = search_runs(run)
    return one


@pytest.fixture(scope="module")
def read(run, drawn):
    return drawn(run)


def overlaps(assembly, column):
    """(T,) whether the balls of a pair meet, from their centres alone."""
    motion, balls, centres = assembly.motion, [], []
    for body in assembly.pairs[column].tolist():
        ball = sphere_best(assembly.bodies[body].mesh)
        balls.append(ball.radius)
        centres.append(motion.rotations[:, body] @ ball.centre + motion.translations[:, body])
    return np.linalg.norm(centres[0] - centres[1], axis=1) <= sum(balls)


def test_the_funnel_counts_what_the_run_counted(run, watched, read):
    detection = run.detections[LABEL]
    spheres = sum(
        (overlaps(run.assembly, column) & run.assembly.motion.valid[:, ends].all(axis=1)).astype(int)
        for column, ends in enumerate(run.assembly.pairs)
    )
    steps = {
        stage: f"{ROOT}/pairs/{k}_{stage.replace(' ', chr(92) + ' ')}"
        for k, stage in enumerate(list(watched.counts)[1:], 1)
    }
    told = {
        stage: [read.at(path, "Scalars:scalars", t)[0] for t in range(len(detection.times))]
        for stage, path in steps.items()
    }
    assert told["spheres meet"] == spheres.tolist()
    assert sum(told["searched"]) == np.sum(detection.work["looks"]) > 0
    assert told["confirmed"] == (detection.verdict == 1).sum(axis=1).tolist()
    assert (np.array(told["boxes meet"]) <= told["spheres meet"]).all()


def test_every_moment_of_the_list_has_its_samples_from_its_first_frame_to_its_last(watched, read):
    assert {FOUND, LOST} <= {moment.kind for moment in watched.searches}
    listed = read.column(f"{ROOT}/moments", "TextLog:text")
    assert [row[1] for row in listed] == [moment.frame for moment in watched.searches]
    starts = {moment.frame for moment in watched.searches} | {moment.first for moment in watched.searches}
    for moment in watched.searches:
        trace = watched.trace(moment)
        ants = sum(len(np.unique(trace.faces[np.isfinite(trace.pheromone), k])) for k in (0, 1))
        for frame in {moment.frame, moment.last, moment.first} - (starts - {moment.frame}):
            colours = read.at(f"{ROOT}/search/dots", "Points3D:colors", frame)
            assert colours.count(packed([SERIES[1]])[0]) == ants
            way = [width for width in read.at(f"{ROOT}/search/lines", "LineStrips3D:radii", frame) if width == -2.0]
            assert len(way) == len(trace.best()) - 1


def test_a_missed_contact_is_red_where_the_surfaces_meet_and_says_how_far_the_search_ended_from_it(run, watched, read):
    lost = [moment for moment in watched.searches if moment.kind == LOST]
    assert lost
    for moment in lost:
        *_, stop, meets = read.at(f"{ROOT}/search/dots", "Points3D:positions", moment.frame)
        assert read.at(f"{ROOT}/search/dots", "Points3D:colors", moment.frame)[-1] == packed([MISSED])[0]
        section = run.detections["hybrid"].section(moment.frame, moment.pair).mean(axis=1)
        assert np.linalg.norm(section - meets, axis=1).min() < 1e-6
        words = read.at(f"{ROOT}/search/words", "Points3D:labels", moment.frame)[-1]
        assert words.startswith("missed") and f"{1e3 * np.linalg.norm(np.subtract(stop, meets)):.0f} mm" in words
    found = next(moment for moment in watched.searches if moment.kind == FOUND)
    assert read.at(f"{ROOT}/search/dots", "Points3D:colors", found.frame)[-1] == packed([SERIES[2]])[0]


def test_without_a_moment_of_its_own_an_instant_shows_the_worked_moment_with_its_volumes(run, watched, read):
    worked, frames = watched.worked, range(len(run.assembly.motion))
    assert worked.kind == LOST
    covered = {frame for one in watched.searches for frame in range(one.first, one.last + 1)}
    free = next(frame for frame in frames if frame not in covered)
    for body in run.assembly.pairs[worked.pair].tolist():
        name, mesh = run.assembly.names[body], run.assembly.bodies[body].mesh
        (place,) = read.at(f"{ROOT}/bodies/{name}", "Transform3D:translation", free)
        assert np.allclose(place, run.assembly.motion.translations[worked.frame, body], atol=1e-6)
        if name != "bench":
            (half,) = read.at(f"{ROOT}/bodies/{name}/box", "Boxes3D:half_sizes", free)
            ((reach, _, _),) = read.at(f"{ROOT}/bodies/{name}/sphere", "Ellipsoids3D:half_sizes", free)
            assert np.allclose(half, box_best(mesh).half, atol=1e-6)
            assert reach == pytest.approx(sphere_best(mesh).radius, rel=1e-6)
    (ground,) = read.at(f"{ROOT}/bodies/bench/mesh", "Mesh3D:albedo_factor", free)
    assert ground & 0xFF == 0xFF, "the ground is drawn, and solid"
    (frame,) = read.at(f"{ROOT}/frame", "TextDocument:text", free)
    assert f"| confirmed | {watched.counts['confirmed'][worked.frame]}, missed" in frame


def test_the_view_of_the_volumes_holds_both_spheres_whole(run, watched, read):
    # The view is 595 pixels wide and 640 high, and its eye opens 0.9 radians upward.
    half = np.arctan(np.tan(0.45) * 595 / 640)
    for moment in watched.searches:
        (eye,) = read.at(f"{ROOT}/near/eye", "Transform3D:translation", moment.frame)
        (turn,) = read.at(f"{ROOT}/near/eye", "Transform3D:quaternion", moment.frame)
        axes = rotation_from_quaternion(np.array(turn))
        for body in run.assembly.pairs[moment.pair].tolist():
            ball = sphere_best(run.assembly.bodies[body].mesh)
            if ball.radius < 0.5:
                turned = run.assembly.motion.rotations[moment.frame, body] @ ball.centre
                middle = (turned + run.assembly.motion.translations[moment.frame, body] - eye) @ axes
                assert -middle[2] * np.sin(half) - abs(middle[0]) * np.cos(half) >= ball.radius


def test_a_detector_without_a_search_has_no_pipeline(demo):
    assert search_runs(demo) == []
