"""The sweep of a tradeoff: which settings it tries within its time, and what it counts of each."""

import json
from contextlib import contextmanager
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from support.small_worlds import session_of_frames, unit_cubes_on_x

from cdcore.kernels import compiling
from replay.advice import sweep as trading
from replay.advice.sweep import FRONT_PASSES, PASSES_PER_SETTING, tradeoff
from replay.engine import compute
from replay.errors import TradeoffError
from sessions.model.scene import Scene, SceneBody, SceneEffect
from sessions.synthetic.scenes import make_scene_session

TRIED_SETTINGS = {
    "FCL": "hybrid",
    "exact": "exact",
    "rare": "discrete[rate_hz=20]",
    "boxes": "collider[shape=box]",
    "balls": "sphere",
    "between": "continuous",
}


@pytest.fixture(scope="module")
def finished_tradeoff(bumped):
    """The tradeoff of a session of two cubes, in which every setting of ``TRIED_SETTINGS`` was tried."""
    return tradeoff(bumped, detectors=TRIED_SETTINGS)


def audit_counts(run, label):
    """Contacts, those missed and late, false contacts and their fraction, and a digest, of a detector of a run."""
    audit = run.document.audit[label]
    counts = audit.contacts, audit.contacts_missed, audit.late_or_cut_short, len(run.false[label])
    return *counts, audit.false_contact.value, run.detections[label].digest


def row_counts(row):
    """The same of a row of a tradeoff."""
    keys = ("contacts", "missed", "late", "false_contacts", "false", "digest")
    return tuple(row[key] for key in keys)


def session_with_effect_and_lost_pose():
    """Three cubes, an effect that needs the pair a and b alone, and a quaternion of zeros, which the policy drops."""
    positions = {"a": [0] * 8, "b": [3, 0.9, 3, 0.9, 3, 1.4, 0.9, 3], "c": [0.9, 3, 3, 3, 3, 3, 3, 0.9]}
    near = SceneEffect("contact", {"between": ["a", "b"]})
    scene = Scene("room", bodies=tuple(SceneBody(name) for name in positions), effects=(near,))
    session = unit_cubes_on_x(positions, scene=scene)
    quaternion = session.frames.quaternion_xyzw.copy()
    quaternion[3, 1] = 0.0
    return replace(session, source=replace(session.frames, quaternion_xyzw=quaternion))


@pytest.mark.slow
@pytest.mark.parametrize(
    "make_session",
    [
        pytest.param(session_with_effect_and_lost_pose, id="three cubes, an effect, a lost pose"),
        pytest.param(lambda: unit_cubes_on_x({"a": [0] * 6, "b": [3, 0.9, 3, 1.4, 0.9, 3]}), id="two cubes"),
    ],
)
def test_counts_of_every_setting_match_an_audit(make_session):
    """A tradeoff tries three detectors, and a run audits the same ones: pairs, frames and all counts are equal.

    Both are judged by ``continuous``, and drop poses whose quaternion is zero.
    """
    session = make_session()
    options = {
        "detectors": "exact,hybrid,collider[shape=sphere]",
        "policy": ["zero-quaternion=drop"],
        "oracle": "continuous",
    }
    run, finished = compute(session, **options), tradeoff(session, **options)
    assert finished.about["pairs"] == len(run.assembly.pairs)
    assert finished.about["frames"] == len(run.assembly.motion)
    assert len(finished.rows) == 3
    assert [row_counts(row) for row in finished.rows] == [audit_counts(run, row["label"]) for row in finished.rows]


@pytest.fixture(scope="module")
def tradeoff_of_the_demo():
    """The session of the demo, and its tradeoff within 20 s."""
    session, _truth = make_scene_session("bench-bumps")
    return session, tradeoff(session, time_limit=20.0)


@pytest.mark.slow
def test_demo_sweep_tries_twelve_settings_in_twenty_seconds(tradeoff_of_the_demo):
    """The tradeoff of the demo within 20 s tries 12 settings at least, of which 3 are on the front.

    Unless other programs had over 5 % of the processor: then it tries any.
    """
    _session, finished = tradeoff_of_the_demo
    if finished.about["processor_share"] > 0.95:
        assert len(finished.rows) >= 12
        assert len(finished.front) >= 3
    else:
        assert finished.rows


@pytest.mark.slow
def test_figures_of_the_demo_sweep_are_those_of_a_run(tradeoff_of_the_demo):
    """Hulls at 50 Hz and the paper's search, of which a run audits the same settings.

    Counts of hulls depend on when sampling starts: their smallest and largest number, and the mean false fraction.
    """
    session, finished = tradeoff_of_the_demo
    row_of_label = {row["label"]: row for row in finished.rows}
    hulls, paper = row_of_label["hulls at 50 Hz"], row_of_label["paper"]
    run = compute(session, detectors={"hulls": hulls["settings"], "paper": paper["settings"]})
    assert row_counts(paper) == audit_counts(run, "paper")
    missed = run.phases["hulls"].spreads()["contacts_missed"]
    assert (hulls["missed_smallest"], hulls["missed_largest"]) == (missed["smallest"], missed["largest"])
    assert hulls["false"] == run.phases["hulls"].proportions()["false_contact"].value


def test_settings_on_the_front_are_timed_in_more_passes(finished_tradeoff):
    """A pass times all frames once: each of six settings has three at least, those on the front seven.

    Several passes give an interval of the mean (``mean_low``).
    """
    rows = finished_tradeoff.rows
    assert (PASSES_PER_SETTING, FRONT_PASSES) == (3, 7)
    assert min(row["passes"] for row in rows) >= 3
    assert max(row["passes"] for row in rows) == 7
    assert [row["label"] for row in rows if row["mean_low"] is None] == []


def test_detector_of_all_frames_at_once_has_no_p99(finished_tradeoff):
    """One of six settings, ``between``, decides the way between frames, for all of them at once.

    So no frame has a time of its own, and there is no time that 99 of 100 frames do not exceed.
    """
    assert [row["label"] for row in finished_tradeoff.rows if row["p99_ms"] is None] == ["between"]


def test_rows_of_a_tradeoff_are_sorted_by_loss(finished_tradeoff):
    """A tradeoff has a row for each of six settings that were tried; the least loss comes first."""
    losses = [row["loss"] for row in finished_tradeoff.rows]
    assert len(losses) == len(TRIED_SETTINGS)
    assert losses == sorted(losses)


def test_rows_of_a_tradeoff_mark_oracle_and_front(finished_tradeoff):
    """``exact`` is the oracle, by which all six settings are judged.

    Rows on the front are those whose label it lists.
    """
    rows, front = finished_tradeoff.rows, finished_tradeoff.front
    assert front
    assert [row["label"] for row in rows if row["oracle"]] == ["exact"]
    assert {row["label"] for row in rows if row["front"]} == set(front)


def test_tradeoff_is_plain_json_without_nan(finished_tradeoff):
    """Some numbers are not known, such as the p99 of ``between``, which has no times of single frames.

    They are not written as NaN or infinity, which JSON does not know, and other programs refuse.
    """
    text = json.dumps(finished_tradeoff.as_json(), allow_nan=False)
    assert '"exact"' in text


def test_compound_is_skipped_where_cutting_exceeds_time_limit(bumped, monkeypatch):
    """A compound is a body cut into convex pieces, here 4, which is said to take 4 * 1000 s: the limit is 60 s.

    ``cut`` has the labels of settings that the time limit left out: that of the compound, not exact.
    """
    settings = {"exact": "exact", "pieces": "collider[shape=compound,pieces=4]"}
    monkeypatch.setattr(trading, "seconds_to_cut", lambda bodies, pairs, settings: 1000.0 * settings["pieces"])
    assert tradeoff(bumped, detectors=settings, time_limit=60.0).cut == ("pieces",)


def test_setting_whose_passes_exceed_the_time_limit_is_not_timed(bumped, monkeypatch):
    """The seconds that a pass is reckoned to last are multiplied by 1e12, usually 1.5: years, but 600 s are left.

    The first setting is tried whatever it takes, and all others are left out (``cut``).
    """
    monkeypatch.setattr(trading, "PASS_OVERHEAD_FACTOR", 1e12)
    finished = tradeoff(bumped, detectors=TRIED_SETTINGS, time_limit=600.0)
    (row,) = finished.rows
    assert {row["label"], *finished.cut} == set(TRIED_SETTINGS)


def limited_tradeoff(session, monkeypatch, compiling_seconds):
    """The tradeoff within 20 s of a clock that goes on by 1 s at each look, and how late that clock is at its end.

    ``compiling_seconds``: how long kernels are said to have compiled meanwhile.
    """

    @contextmanager
    def reported(tell):
        yield SimpleNamespace(seconds=compiling_seconds)

    clock = iter(range(100_000))
    with monkeypatch.context() as patch:
        patch.setattr(compiling, "compiling_reported", reported)
        patch.setattr(trading, "perf_counter", lambda: float(next(clock)))
        finished = tradeoff(session, detectors=TRIED_SETTINGS, time_limit=20.0)
    return finished, next(clock)


def test_settings_beyond_the_time_limit_are_left_out(bumped, monkeypatch):
    """A limit of 20 s of a clock that goes on by 1 s at each look; no kernel compiles, so no time is given back.

    Some of six settings are tried, all others left out (``cut``). Nothing is begun once the time is up; what was begun
    then is finished within 20 further looks, a bound by trial. Preparing a setting lies between two looks: 1 s.
    """
    finished, seconds_at_end = limited_tradeoff(bumped, monkeypatch, compiling_seconds=0.0)
    tried = {row["label"] for row in finished.rows}
    assert seconds_at_end < 20 + 20
    assert 1 <= len(tried) < len(TRIED_SETTINGS)
    assert set(finished.cut) == set(TRIED_SETTINGS) - tried
    assert {row["prepare_seconds"] for row in finished.rows} == {1.0}


def test_time_limit_excludes_compiling(bumped, monkeypatch):
    """Six settings within 20 s of a clock that goes on by 1 s at each look; kernels are said to compile for 1800 s.

    This time is given back, and the looks take far less: no setting is left out (``cut``).
    """
    finished, _end = limited_tradeoff(bumped, monkeypatch, compiling_seconds=1800.0)
    assert finished.cut == ()


def test_pose_dropped_by_the_policy_gives_no_contact():
    """Eight frames of 10 ms; unit cube b is in contact with a in frames 1, 2 and 5; in 5 its quaternion is zero.

    The policy drops that pose, so one contact is left; the tradeoff starts at 10 ms and has 60 ms.
    """
    positions = [[[0, 0, 0], [x, 0, 0]] for x in (3, 0.9, 0.9, 3, 3, 0.9, 3, 3)]
    rotations = np.tile([0.0, 0.0, 0.0, 1.0], (8, 2, 1))
    rotations[5, 1] = 0.0
    session = session_of_frames(range(0, 80_000_000, 10_000_000), [[1, 1]] * 8, positions, rotations)
    finished = tradeoff(session, detectors="hybrid", policy=["zero-quaternion=drop"], start=0.01)
    row, *_ = finished.rows
    assert (row["contacts"], row["loss"]) == (1, 0)
    assert finished.about["seconds"] == pytest.approx(0.06)


def test_invalid_tradeoff_arguments_are_refused_in_a_sentence(bumped):
    """``noise`` is an argument of ``replay.run``, which takes most of those of a tradeoff."""
    with pytest.raises(TypeError, match="takes no noise"):
        tradeoff(bumped, noise="vive")


def test_session_without_contact_is_refused():
    """Unit cubes, 3 and then 4 m from middle to middle: without a contact no setting can miss one."""
    with pytest.raises(TradeoffError, match="nothing can be missed"):
        tradeoff(unit_cubes_on_x({"a": [0, 0], "b": [3, 4]}), detectors=TRIED_SETTINGS)
