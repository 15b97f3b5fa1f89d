"""The eye finds the side from which nothing hides a contact, and stays on what it looks at."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cdcore import Body, Motion, TriangleMesh
from cdcore.transforms.rigid import rotation_from_quaternion
from replay.errors import RunFolderError
from replay.outputs.camera import (
    ASPECT,
    CLOSE_UP,
    FIELD_OF_VIEW,
    Eye,
    Obstacles,
    _Surface,
    directions,
    look_rotation,
    overview,
    towards_user,
)
from replay.outputs.rerun_log import focus as module
from replay.outputs.rerun_log.focus import Focus, eyes_of, focus, moments, read_misses
from replay.outputs.rerun_log.recording import write_recording
from replay.pipeline.run_result import RunResult
from replay.prepare.assembly import Assembly
from sessions import Scene


def wall(at: float, size: float = 0.2) -> TriangleMesh:
    """A square across the x axis."""
    corners = [[at, y, z] for y in (-size, size) for z in (-size, size)]
    return TriangleMesh(corners, [[0, 1, 2], [1, 3, 2]])


def still(*bodies: Body) -> Assembly:
    count = len(bodies)
    motion = Motion([0.0], np.zeros((1, count, 3)), np.tile(np.eye(3), (1, count, 1, 1)))
    none = np.zeros((0, 2), dtype=np.int64)
    return Assembly(bodies, motion, none, np.zeros(0, bool), np.zeros(1, np.int64), np.ones((1, count), np.uint8))


def test_there_are_32_directions_of_unit_length_all_above_the_bench() -> None:
    choices = directions()
    assert choices.shape == (32, 3)
    assert np.allclose(np.linalg.norm(choices, axis=1), 1.0)
    assert choices[:, 1].min() > 0
    assert len(np.unique(choices.round(9), axis=0)) == 32


@pytest.mark.parametrize(("at", "sign"), [(0.03, -1), (-0.03, 1)])
def test_the_eye_stands_on_the_free_side_of_a_wall(at: float, sign: int) -> None:
    obstacles = Obstacles(still(Body("board", wall(at))), Scene())
    eye = obstacles.close_up(0, (0.0, 0.0, 0.0), np.array([-sign * 1.0, 0.0, 0.0]))
    assert np.sign(eye.position[0]) == sign or eye.position[0] * np.sign(at) < 0.03
    assert np.linalg.norm(eye.position) == pytest.approx(CLOSE_UP)


def test_without_obstacles_the_eye_stands_on_the_users_side() -> None:
    obstacles = Obstacles(still(Body("far", wall(5.0))), Scene())
    user = np.array([0.6, 0.0, 0.8])
    eye = obstacles.close_up(0, (0.0, 0.0, 0.0), user)
    assert np.dot(eye.position, user) / CLOSE_UP > 0.9


def test_crossings_are_those_of_a_ray_by_ray_count() -> None:
    random = np.random.default_rng(3)
    corners = random.normal(size=(60, 3)) * 0.06
    mesh = TriangleMesh(corners, random.integers(0, 60, (40, 3)))
    rays = directions()
    counted = _Surface(mesh).crossings(np.zeros(3), rays, CLOSE_UP)
    slow = np.zeros(len(rays), dtype=int)
    for k, ray in enumerate(rays):
        for a, b, c in mesh.triangles:
            matrix = np.stack([b - a, c - a, -ray], axis=1)
            if abs(np.linalg.det(matrix)) > 1e-15:
                u, v, t = np.linalg.solve(matrix, -a)
                slow[k] += u >= 0 and v >= 0 and u + v <= 1 and 0.003 < t < CLOSE_UP
    assert counted.tolist() == slow.tolist()
    assert slow.sum() > 10


def test_a_body_without_a_pose_hides_nothing(demo: RunResult) -> None:
    hidden = still(Body("board", wall(0.03)))
    gone = Motion([0.0], hidden.motion.translations, hidden.motion.rotations, np.zeros((1, 1), dtype=bool))
    user = np.array([1.0, 0.0, 0.0])
    eye = Obstacles(replace(hidden, motion=gone), Scene()).close_up(0, (0.0, 0.0, 0.0), user)
    assert eye.position[0] > 0.09


def test_the_user_is_where_the_headset_is(demo: RunResult) -> None:
    found = towards_user(demo.assembly, demo.session.scene, 0, (0.0, 0.0, 0.0))
    assert np.allclose(found, np.array([0.25, 0.0, 0.7]) / np.hypot(0.25, 0.7))
    assert towards_user(still(Body("x", wall(0.0))), Scene(), 0, (0.0, 0.0, 0.0)).tolist() == [0, 0, 1]


def test_the_overview_holds_every_point_and_wastes_no_room(demo: RunResult) -> None:
    random = np.random.default_rng(1)
    points = random.uniform([-0.5, 0.9, -0.1], [0.5, 1.1, 0.1], (50, 3))
    eye = overview(demo.assembly, demo.session.scene, points, 0)
    local = (points - eye.position) @ look_rotation(eye)
    slope = np.tan(FIELD_OF_VIEW / 2)
    reach = np.maximum(np.abs(local[:, 0]) / (slope * ASPECT), np.abs(local[:, 1]) / slope) / -local[:, 2]
    assert 0.7 < reach.max() < 1.0


def test_a_camera_looks_along_its_negative_third_axis_with_its_head_up() -> None:
    turn = look_rotation(Eye((1.0, 1.0, 0.0), (0.0, 0.0, 0.0)))
    assert np.allclose(turn @ turn.T, np.eye(3))
    assert np.linalg.det(turn) == pytest.approx(1.0)
    assert np.allclose(-turn[:, 2], np.array([-1, -1, 0]) / np.sqrt(2))
    assert turn[1, 1] > 0


SUBJECT = "22.5Hz"


def test_where_the_cursor_meets_a_miss_the_eye_looks_at_it(demo: RunResult, read: Any, recording: Path) -> None:
    places = {place.number: place.session_ns for place in read_misses(recording)}
    shared = [miss.deepest for miss in demo.misses[SUBJECT]]
    assert len(set(shared)) < len(shared)
    for miss in demo.misses[SUBJECT]:
        place = np.array(read.at_ns("world/missed/eye", "Transform3D:translation", places[miss.number])[0])
        q = np.array(read.at_ns("world/missed/eye", "Transform3D:quaternion", places[miss.number])[0])
        assert np.allclose(place - CLOSE_UP * rotation_from_quaternion(q)[:, 2], miss.point, atol=1e-5)


def numbers(shown: list[Focus]) -> dict[tuple[int, int], int]:
    return {(one.frame, one.later): one.miss.number for one in shown}


def test_the_focus_changes_half_way_between_two_misses(demo: RunResult) -> None:
    one, two = demo.misses[SUBJECT][:2]
    a = replace(one, number=1, first=10, last=20, deepest=15)
    b = replace(two, number=2, first=41, last=50, deepest=45)
    assert numbers(focus([a, b])) == {(0, 0): 1, (15, 0): 1, (31, 0): 2, (45, 0): 2}


def test_overlapping_misses_are_both_met_where_the_list_leads(demo: RunResult) -> None:
    one, two = demo.misses[SUBJECT][:2]
    a = replace(one, number=1, first=10, last=60, deepest=50)
    b = replace(two, number=2, first=20, last=30, deepest=25)
    at = numbers(focus([a, b]))
    assert (at[25, 0], at[50, 0]) == (2, 1)


def test_misses_that_are_deepest_in_one_frame_follow_each_other_longest_last(demo: RunResult) -> None:
    one = replace(demo.misses[SUBJECT][0], number=1, cut_length=0.3)
    two = replace(one, number=2, cut_length=0.2)
    three = replace(one, number=3, cut_length=0.1)
    at = numbers(focus([one, two, three]))
    assert [at[one.deepest, later] for later in range(3)] == [3, 2, 1]
    assert moments([one, two, three]) == {3: (one.deepest, 0), 2: (one.deepest, 1), 1: (one.deepest, 2)}


def test_beyond_the_counted_ones_every_miss_still_has_its_eye(demo: RunResult, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = eyes_of(demo.assembly, demo.session.scene, demo.misses[SUBJECT])
    monkeypatch.setattr(module, "COUNTED", 1)
    few = eyes_of(demo.assembly, demo.session.scene, demo.misses[SUBJECT])
    assert sorted(few) == sorted(whole) == [miss.number for miss in demo.misses[SUBJECT]]
    for miss in demo.misses[SUBJECT]:
        away = np.subtract(few[miss.number].position, miss.point)
        assert np.linalg.norm(away) == pytest.approx(CLOSE_UP)


def test_misses_read_back_with_the_nanosecond_of_their_deepest_frame(demo: RunResult, recording: Path) -> None:
    stamps, misses = demo.assembly.stamp_ns - demo.assembly.stamp_ns[0], demo.misses["22.5Hz"]
    at = moments(misses)
    assert [(one.number, one.session_ns, one.cut_length) for one in read_misses(recording)] == [
        (miss.number, int(stamps[at[miss.number][0]]) + at[miss.number][1], miss.cut_length) for miss in misses
    ]


def test_a_recording_without_misses_has_none(demo: RunResult, tmp_path: Path) -> None:
    write_recording(replace(demo, misses={"22.5Hz": ()}), tmp_path / "none.rrd")
    assert read_misses(tmp_path / "none.rrd") == []


@pytest.mark.parametrize("content", [b"", b"not a recording"])
def test_a_file_that_is_no_recording_is_one_sentence(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "run.rrd").write_bytes(content)
    with pytest.raises(RunFolderError, match=r"run\.rrd cannot be read as a recording"):
        read_misses(tmp_path / "run.rrd")
