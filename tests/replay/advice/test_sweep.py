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
def sweep(bumped):
    """The tradeoff of a bench that is bumped, every setting of LIST tried."""
    return tradeoff(bumped, detectors=TRIED_SETTINGS)


def audit_counts(run, label):
    """Counts of a run, of a detector without a step rate."""
    audit = run.document.audit[label]
    counts = audit.contacts, audit.contacts_missed, audit.late_or_cut_short, len(run.false[label])
    return *counts, audit.false_contact.value, run.detections[label].digest


def row_counts(row):
    """Counts of a row of the tradeoff."""
    keys = ("contacts", "missed", "late", "false_contacts", "false", "digest")
    return tuple(row[key] for key in keys)


def effects_world():
    """A scene whose effects name their pairs, and a pose that the policy drops: what an audit would not ask of all."""
    positions = {"a": [0] * 8, "b": [3, 0.9, 3, 0.9, 3, 1.4, 0.9, 3], "c": [0.9, 3, 3, 3, 3, 3, 3, 0.9]}
    near = SceneEffect("contact", {"between": ["a", "b"]})
    scene = Scene("room", bodies=tuple(SceneBody(name) for name in positions), effects=(near,))
    session = unit_cubes_on_x(positions, scene=scene)
    quaternion = session.frames.quaternion_xyzw.copy()
    quaternion[3, 1] = 0.0
    return replace(session, source=replace(session.frames, quaternion_xyzw=quaternion))


@pytest.mark.slow
def test_counts_of_every_setting_match_an_audit():
    """One world has effects, lost poses and a declared pair, the other two cubes alone."""
    how = {"detectors": "exact,hybrid,collider[shape=sphere]", "policy": ["zero-quaternion=drop"]}
    for world in (effects_world(), unit_cubes_on_x({"a": [0] * 6, "b": [3, 0.9, 3, 1.4, 0.9, 3]})):
        run, done = compute(world, oracle="continuous", **how), tradeoff(world, oracle="continuous", **how)
        assert done.about["pairs"] == len(run.assembly.pairs) and done.about["frames"] == len(run.assembly.motion)
        assert [row_counts(row) for row in done.rows] == [audit_counts(run, row["label"]) for row in done.rows]


@pytest.mark.slow
def test_demo_sweep_tries_twelve_settings_in_twenty_seconds():
    """The figures of hulls and of the paper's search are those of an audit."""
    session = make_scene_session("bench-bumps")[0]
    done = tradeoff(session, time_limit=20.0)
    quiet = done.about["processor_share"] > 0.95
    assert len(done.rows) >= 12 or not quiet
    assert len(done.front) >= 3 or not quiet
    by_label = {row["label"]: row for row in done.rows}
    run = compute(
        session, detectors={"hulls": by_label["hulls at 50 Hz"]["settings"], "paper": by_label["paper"]["settings"]}
    )
    assert row_counts(by_label["paper"]) == audit_counts(run, "paper")
    over, hulls = run.phases["hulls"].spreads(), by_label["hulls at 50 Hz"]
    assert [hulls["missed_smallest"], hulls["missed_largest"]] == [
        over["contacts_missed"][end] for end in ("smallest", "largest")
    ]
    assert hulls["false"] == run.phases["hulls"].proportions()["false_contact"].value


def test_settings_are_timed_in_three_passes_and_sorted_by_loss(sweep):
    """Settings on the front are timed in seven passes. ``oracle``: the setting by which all are judged."""
    assert all(row["passes"] >= PASSES_PER_SETTING and row["mean_low"] is not None for row in sweep.rows)
    assert max(row["passes"] for row in sweep.rows) == FRONT_PASSES
    # Between frames nobody asks live, so no frame has a time of its own.
    assert [row["label"] for row in sweep.rows if row["p99_ms"] is None] == ["between"]
    losses = [row["loss"] for row in sweep.rows]
    assert losses == sorted(losses) and len(losses) == len(TRIED_SETTINGS)
    assert [row["label"] for row in sweep.rows if row["oracle"]] == ["exact"]
    assert sweep.front and all(row["front"] == (row["label"] in sweep.front) for row in sweep.rows)
    json.dumps(sweep.as_json(), allow_nan=False)


def test_compound_is_skipped_where_cutting_exceeds_time_limit(bumped, monkeypatch):
    """Cutting into 4 pieces is said to take 4000 s of the 60 s; ``cut``: settings that the time limit left out."""
    requested = {"exact": "exact", "pieces": "collider[shape=compound,pieces=4]"}
    monkeypatch.setattr(trading, "seconds_to_cut", lambda bodies, settings: 1000.0 * settings["pieces"])
    assert tradeoff(bumped, detectors=requested, time_limit=60.0).cut == ("pieces",)


def test_setting_whose_passes_exceed_the_time_limit_is_not_timed(bumped, monkeypatch):
    """A pass of any setting is taken to last for years; the first setting is tried all the same."""
    monkeypatch.setattr(trading, "PASS_OVERHEAD_FACTOR", 1e12)
    done = tradeoff(bumped, detectors=TRIED_SETTINGS, time_limit=600.0)
    (row,) = done.rows
    assert {row["label"], *done.cut} == set(TRIED_SETTINGS)


def test_time_limit_cuts_last_settings_and_excludes_compiling(bumped, monkeypatch):
    """The limit is 20 s of a clock that goes on by 1 s at each look; half an hour of compiling does not count."""

    def limited(compiled):
        @contextmanager
        def reported(tell):
            yield SimpleNamespace(seconds=compiled)

        clock = iter(range(100000))
        with monkeypatch.context() as patch:
            patch.setattr(compiling, "compiling_reported", reported)
            patch.setattr(trading, "perf_counter", lambda: float(next(clock)))
            return tradeoff(bumped, detectors=TRIED_SETTINGS, time_limit=20.0), next(clock)

    done, ended = limited(0.0)
    assert ended < 40  # once the time is up nothing is begun
    assert 1 <= len(done.rows) < len(TRIED_SETTINGS)
    assert {row["prepare_seconds"] for row in done.rows} == {1.0}  # from one tick of the clock to the next
    assert set(done.cut) == {*TRIED_SETTINGS} - {row["label"] for row in done.rows}
    assert not limited(1800.0)[0].cut


def test_pose_dropped_by_the_policy_gives_no_contact():
    """Cube b touches in frames 1, 2 and, but for its dropped zero quaternion, 5; the window starts with frame 1."""
    positions = [[[0, 0, 0], [x, 0, 0]] for x in (3, 0.9, 0.9, 3, 3, 0.9, 3, 3)]
    rotations = np.tile([0.0, 0.0, 0.0, 1.0], (8, 2, 1))
    rotations[5, 1] = 0.0
    session = session_of_frames(range(0, 80_000_000, 10_000_000), [[1, 1]] * 8, positions, rotations)
    done = tradeoff(session, detectors="hybrid", policy=["zero-quaternion=drop"], start=0.01)
    row, *_ = done.rows
    assert row["contacts"] == 1 and row["loss"] == 0
    assert done.about["seconds"] == pytest.approx(0.06)


def test_invalid_tradeoff_arguments_are_refused_in_a_sentence(bumped):
    """``noise`` is an argument of other functions."""
    with pytest.raises(TypeError, match="takes no noise"):
        tradeoff(bumped, noise="vive")


def test_session_without_contact_is_refused():
    """Unit cubes with 3 and 4 m between their centres."""
    with pytest.raises(TradeoffError, match="nothing can be missed"):
        tradeoff(unit_cubes_on_x({"a": [0, 0], "b": [3, 4]}), detectors=TRIED_SETTINGS)
