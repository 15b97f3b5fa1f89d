import json
import re
from contextlib import contextmanager
from dataclasses import replace
from types import SimpleNamespace

import pytest
from support.small_worlds import cubes

from cdcore.detectors import DETECTORS
from cdcore.kernels import compiling
from replay.pipeline.engine import compute
from replay.tradeoffs import sweep as trading
from replay.tradeoffs.pareto import LIVE, WHOLE, tied
from replay.tradeoffs.settings import ASKED, Setting
from replay.tradeoffs.sweep import LEAST_PASSES, tradeoff
from sessions.model.scene import Scene, SceneBody, SceneEffect
from sessions.synthetic.bench_bumps import make_bench_bumps

LIST = (
    Setting("hybrid", "as it comes", ""), Setting("exact", "as it comes", ""),
    Setting("discrete", "step rate", "20 Hz", {"rate_hz": 20.0}),
    Setting("hybrid", "mesh resolution", "500 mm", cell=0.5), Setting("sphere", "as it comes", ""),
)  # fmt: skip


@pytest.fixture(scope="module")
def done(bumped):
    return tradeoff(bumped, settings=LIST)


def counted(row):
    """Counts that an audit has too."""
    frames = [row[name] for name in ("both", "missed_pair_frames", "invented_pair_frames", "left_out")]
    return frames, row["within_tolerance"], row["contacts"], row["contacts_missed"], row["digest"]


def audited(run, label):
    audit = run.summary["audit"][label]
    kinds = audit["pair_frames"]
    frames = [kinds[name] for name in ("BOTH", "MISSED", "INVENTED", "LEFT_OUT")]
    counts = kinds["WITHIN_TOLERANCE"], audit["contacts"], audit["contacts_missed"]
    return frames, *counts, run.detections[label].digest


def effects_world():
    """A scene whose effects name their pairs, and a pose that the policy drops: what an audit would not ask of all."""
    places = {"a": [0] * 8, "b": [3, 0.9, 3, 0.9, 3, 1.4, 0.9, 3], "c": [0.9, 3, 3, 3, 3, 3, 3, 0.9]}
    near = SceneEffect("contact", {"between": ["a", "b"]})
    scene = Scene("room", bodies=tuple(SceneBody(name) for name in places), effects=(near,))
    session = cubes(places, scene=scene)
    quaternion = session.frames.quaternion_xyzw.copy()
    quaternion[3, 1] = 0.0
    return replace(session, source=replace(session.frames, quaternion_xyzw=quaternion))


def test_counts_of_every_setting_are_those_of_an_audit_of_the_same_session():
    specs = "exact,hybrid,discrete[rate_hz=40],collider[shape=sphere]"
    how = {"detectors": specs, "policy": ["zero-quaternion=drop"]}
    for world in (effects_world(), cubes({"a": [0] * 6, "b": [3, 0.9, 3, 1.4, 0.9, 3]})):
        run, done = compute(world, oracle="continuous", **how), tradeoff(world, oracle="continuous", **how)
        assert done.about["pairs"] == len(run.assembly.pairs) and done.about["frames"] == len(run.assembly.motion)
        assert [counted(row) for row in done.rows] == [audited(run, row["label"]) for row in done.rows]


@pytest.mark.slow
def test_counts_on_the_demo_are_those_of_its_audit_with_what_a_hand_holds_apart():
    session, how = make_bench_bumps()[0], {"detectors": "hybrid,slow=discrete[rate_hz=22.5]"}
    run, done = compute(session, **how), tradeoff(session, repeats=1, **how)
    assert run.holdings and len(done.rows) == 2
    assert [counted(row) for row in done.rows] == [audited(run, row["label"]) for row in done.rows]


@pytest.mark.slow
def test_two_runs_give_the_same_recalls_and_only_times_differ(bumped):
    one, two = (tradeoff(bumped, detectors=[*DETECTORS], repeats=1, time_limit=None) for _ in range(2))
    assert {row["detector"] for row in one.rows} == set(DETECTORS)
    same = ("label", "recall", "precision", "digest", "work", "mesh_faces", "contacts_lost", "complete")
    assert [[row[key] for key in same] for row in one.rows] == [[row[key] for key in same] for row in two.rows]


def test_the_same_setting_twice_comes_out_as_a_tie_and_the_clock_checks_itself(bumped):
    ties = 0
    for _ in range(5):  # on a busy machine one of several may differ
        done = tradeoff(bumped, detectors="a=hybrid,b=hybrid")
        a, b = done.rows
        assert (a["label"], b["label"]) == ("a", "b") and a["complete"] and a["simplicity"] == b["simplicity"]
        checks = done.about["clock"].values()
        for check in checks:
            assert check["passes"] >= LEAST_PASSES and check["tie"] == (check["widened"] == 1.0)
        ties += all(tied(a, b, time) for time in (LIVE, WHOLE)) or not all(check["tie"] for check in checks)
        if ties:
            break
    assert ties


def test_what_advice_may_name_is_timed_in_seven_passes_and_the_rest_as_often_as_asked(bumped):
    complete = [Setting(name, "as it comes", "") for name in ("exact", "hybrid")]
    done = tradeoff(bumped, settings=[*complete, *LIST[2:]], repeats=2)
    for row in done.rows:
        quick = row["label"] in ("exact", "hybrid") and row["passes"] >= LEAST_PASSES
        assert quick or (row["passes"], row["live_passes"]) == (2, 2) or row["complete"]
    assert any(row["live_passes"] >= LEAST_PASSES for row in done.rows if row["complete"])


def test_the_oracle_is_in_the_table_and_what_always_reports_contact_is_not_on_the_front(done):
    assert [row["label"] for row in done.rows if row["oracle"]] == ["exact"]
    assert "sphere" not in (*done.front, *done.front_online), "it invents more than it finds"
    json.dumps(done.as_json(), allow_nan=False)


def test_a_compound_is_not_begun_where_cutting_it_takes_longer_than_there_is_time(bumped, monkeypatch):
    asked = (*LIST[:2], Setting("collider", "pieces", "4", {"shape": "compound", "pieces": 4}))
    monkeypatch.setattr(trading, "seconds_to_cut", lambda meshes, most: 1000.0 * most)
    assert tradeoff(bumped, settings=asked, repeats=1, time_limit=60.0).cut == ("collider pieces 4",)


def test_a_time_limit_cuts_the_tail_and_says_so(bumped, monkeypatch):
    clock = iter(range(100000))
    monkeypatch.setattr(trading, "perf_counter", lambda: float(next(clock)))
    done = tradeoff(bumped, settings=LIST, time_limit=20.0)
    assert 1 <= len(done.rows) < len(LIST)
    assert set(done.cut) == {one.label for one in LIST} - {row["label"] for row in done.rows}


def test_compiling_does_not_count_towards_the_time_limit(bumped, monkeypatch):
    @contextmanager
    def half_an_hour(tell):
        yield SimpleNamespace(seconds=1800.0)

    monkeypatch.setattr(compiling, "compiling_reported", half_an_hour)
    clock = iter(range(100000))
    monkeypatch.setattr(trading, "perf_counter", lambda: float(next(clock)))
    assert not tradeoff(bumped, settings=LIST, repeats=1, time_limit=8.0).cut


def test_what_its_warm_up_foretells_to_take_too_long_is_not_begun_and_the_next_is(bumped, monkeypatch):
    true = trading.whole_pass

    def slow(asked, number=0):
        return [1e6 + one if asked[0].label == "discrete step rate 20 Hz" else one for one in true(asked, number)]

    monkeypatch.setattr(trading, "whole_pass", slow)
    done = tradeoff(bumped, settings=LIST, repeats=1, time_limit=1e4)
    assert done.cut == ("discrete step rate 20 Hz",) and len(done.rows) == len(LIST) - 1


def test_faces_cost_time_and_find_the_same_contacts(bumped):
    listed = [Setting("hybrid", "as it comes", ""), Setting("hybrid", ASKED, "faces", faces=True)]
    booleans, faces = tradeoff(bumped, settings=listed, repeats=1).rows
    assert (booleans["recall"], booleans["digest"]) == (faces["recall"], faces["digest"])
    assert booleans["face_recall"] is None and faces["face_recall"] == 1.0
    assert faces["work"]["face_pairs"] > booleans["work"]["face_pairs"] == 0
    assert faces["p99_ms"] is None and faces["live_passes"] == 0 < booleans["live_passes"]


def lost_by_hand(touching, every, first):
    """Contacts that looks every so many frames lose, each answer held; the first frame of all is looked at."""
    looks = [k for k in range(len(touching)) if k == 0 or k % every == first]
    said = [touching[max(k for k in looks if k <= frame)] for frame in range(len(touching))]
    spans = "".join("C" if one else "." for one in touching)
    contacts = [(one.start(), one.end()) for one in re.finditer("C+", spans)]
    return sum(not all(said[start:stop]) for start, stop in contacts)


def test_what_a_step_rate_loses_is_the_mean_over_its_phases(done):
    (rate,) = (row for row in done.rows if row["axis"] == "step rate")
    touching = [place < 1 for place in (3, 1.3, 1.3, 3, 0.9, 3, 1.3, 1.3, 0.9, 0.8, 1.3, 3)]
    lost = [lost_by_hand(touching, 5, first) for first in range(5)]
    assert 0 < sum(lost) < 10 and rate["phases"] == 16
    assert rate["contacts_lost"] == pytest.approx(sum(lost) / 5, abs=2 / 36)
    assert all(row["phases"] == 1 and row["contacts_lost"] == 0 for row in done.rows if row["complete"])
