"""Engines agree where nothing is hard; what needs an extra is left out when it is absent."""

import numpy as np
import pytest

from replay.studies.bench import engines
from replay.studies.bench.engines import ENGINES, YARDSTICK, frame_by_frame, installed_engines
from replay.studies.bench.workload import make_workload


@pytest.fixture(scope="module")
def answers():
    part = make_workload(200, 900)
    return {(name, what): ENGINES[name](part).ask(what) for name in installed_engines() for what in ("bool", "faces")}


@pytest.mark.parametrize("name", ENGINES)
def test_all_engines_agree_on_which_pairs_touch_when(answers, name):
    if (name, "bool") not in answers:
        pytest.skip(f"{name} is not installed")
    assert answers[YARDSTICK, "bool"].any()
    assert np.array_equal(answers[name, "bool"], answers[YARDSTICK, "bool"])
    assert np.array_equal(answers[name, "faces"] > 0, answers[name, "bool"] > 0)


def test_exact_names_as_many_face_pairs_as_python_fcl(answers):
    assert answers[YARDSTICK, "faces"].max() > 10
    assert np.array_equal(answers["exact", "faces"], answers[YARDSTICK, "faces"])


def test_stages_begin_with_the_check_of_the_poses_and_add_up_to_less_than_the_call():
    seconds, found = ENGINES["exact"](make_workload(100, 300)).staged("faces")
    assert next(iter(seconds)) == "check"
    assert {"poses", "search", "exact", "faces", "containment"} <= set(seconds)
    assert min(seconds.values()) >= 0
    assert found.face_sets is not None


def test_the_plain_loop_places_what_moves_and_nothing_else():
    load, placed = make_workload(100, 5), []
    frame_by_frame(load, lambda body, pose: placed.append(body), lambda row: None)
    assert {load.names[body].split("-")[0] for body in placed} == {"rod", "tube", "hand"}
    assert len(placed) == 5 * 3


def test_what_needs_an_extra_is_left_out_when_absent(monkeypatch):
    monkeypatch.setattr(engines, "find_spec", lambda name: None)
    assert installed_engines() == ["python-fcl", "trimesh", "exact"]
