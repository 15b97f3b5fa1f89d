from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from support.liquid_worlds import glass, poses_at_rest, poses_of_tilted_glass, session_with_effects
from support.small_worlds import unit_cubes_on_x

from replay import run
from replay.auditing.holding import Grasp
from replay.auditing.outcome import Episode
from replay.document.metrics.row import (
    TASK_COLUMN_PREFIX,
    effect_metrics,
    is_intended,
    metric_rows,
)
from replay.effects.output import EffectEvent
from replay.engine import compute
from sessions.model.session import HandTrack
from sessions.synthetic.scenes import make_scene_session

HAND, BEAKER, TABLE = 0, 1, 2
"""Numbers of bodies."""
PAIRS = np.array([[HAND, BEAKER], [BEAKER, TABLE], [HAND, TABLE]])
HAND_AND_BEAKER, BEAKER_AND_TABLE, HAND_AND_TABLE = 0, 1, 2
"""Rows of PAIRS."""
GRASPS_BEAKER = Grasp(hand=HAND, start=4.0, end=6.0, thing=BEAKER)
GRASPS_NOTHING = Grasp(hand=HAND, start=4.0, end=6.0, thing=-1)


@pytest.fixture(scope="module")
def silver_chloride_run():
    """A run over the made-up experiment, and what was planted in it."""
    session, truth = make_scene_session("silver-chloride", seed=1, faces=500)
    return run(session, detectors="slow=discrete[rate_hz=30]", oracle="exact", offline=True), truth


@pytest.fixture(scope="module")
def rows_by_detector(silver_chloride_run):
    """Label of a detector -> its row of metrics."""
    result, _ = silver_chloride_run
    return {row["detector"]: row for row in metric_rows(result)}


def facts_of_kind(truth, kind):
    """The planted facts of a kind."""
    return [fact for fact in truth.facts if fact.kind == kind]


def test_grasps_and_near_misses_equal_planted_counts(silver_chloride_run, rows_by_detector):
    """The generator of a made-up experiment wrote down each grasp and near miss that it planted, and the seconds.

    Breakages are null, not 0: the scene does not ask for them.
    """
    (_, truth), row = silver_chloride_run, rows_by_detector["exact"]
    assert row["grasps"] == row["grasp_attempts"] == len(facts_of_kind(truth, "grasp")) > 0
    assert row["near_misses"] == len(facts_of_kind(truth, "near_miss")) == 1
    assert row["breakages"] is None
    assert row["valid_minutes"] == pytest.approx(truth.seconds / 60, rel=0.02), "all but steps next to a lost pose"


def test_contacts_lie_between_sure_and_nominal_planted_contacts(silver_chloride_run, rows_by_detector):
    """A made-up experiment has contacts that any tessellation and noise leave (``surely``), and others.

    These are there in the smooth shapes (``nominal``, which has the sure ones too); meshes and poses decide how many of
    them are found.
    """
    (_, truth), row = silver_chloride_run, rows_by_detector["exact"]
    sure = [episode for episode in truth.episodes if episode.kind == "contact" and episode.surely]
    of_smooth_shapes = [episode for episode in truth.episodes if episode.nominal]
    contacts = round(row["contacts_per_min"] * row["valid_minutes"])
    assert 0 < len(sure) <= contacts <= len(of_smooth_shapes)


def test_seconds_of_all_tasks_are_the_sum_over_tasks(rows_by_detector):
    """A made-up experiment has several tasks; each has a column of its own in a row, beside that of all."""
    row = rows_by_detector["exact"]
    seconds_of_task = [value for name, value in row.items() if name.startswith(TASK_COLUMN_PREFIX)]
    assert len(seconds_of_task) > 1
    assert row["task_seconds"] == pytest.approx(sum(seconds_of_task))


def test_a_row_has_the_recall_that_the_audit_measured(silver_chloride_run, rows_by_detector):
    """Recall: the fraction of pairs and frames in contact by ``exact``, the reference, that a detector reports too.

    ``slow`` samples a session of 90 Hz at 30 Hz, so it misses some.
    """
    result, _ = silver_chloride_run
    assert set(rows_by_detector) == {"slow", "exact"}
    pair_frames = result.document.audit["slow"].pair_frames
    in_contact = pair_frames.both + pair_frames.missed
    assert rows_by_detector["exact"]["recall"] == 1.0
    assert 0.0 < rows_by_detector["slow"]["recall"] < 1.0
    assert rows_by_detector["slow"]["recall"] == pair_frames.both / in_contact
    assert {row["contact_frames"] for row in rows_by_detector.values()} == {in_contact}


def test_rows_of_a_run_share_session_but_not_settings(rows_by_detector):
    """A run by slow and exact has a row each, with digests of the session and of the detector's settings."""
    assert len({row["session"] for row in rows_by_detector.values()}) == 1
    assert len({row["settings"] for row in rows_by_detector.values()}) == 2


@pytest.mark.parametrize(
    ("detectors", "oracle", "expected"),
    [
        ("hybrid", "exact", [("hybrid", None, 0, 0.0), ("exact", None, 0, 0.0)]),
        ("hybrid", "none", [("hybrid", None, None, 0.0)]),
        ((), None, [("none", None, None, None)]),
    ],
    ids=["no contact", "no oracle", "no detector"],
)
def test_recall_is_absent_without_contact_oracle_or_detector(detectors, oracle, expected):
    """Cubes of 1 m, 3 m apart and more, never touch; ``oracle``: the detector that others are compared with.

    Expected are detector, recall, frames of contact and contacts a minute of each row.
    """
    session = unit_cubes_on_x({"a": [0.0] * 9, "b": list(np.linspace(3, 4, 9))})
    rows = metric_rows(run(session, detectors=detectors, oracle=oracle))
    columns = ("detector", "recall", "contact_frames", "contacts_per_min")
    assert [tuple(row[name] for name in columns) for row in rows] == expected
    assert all(row["valid_minutes"] > 0 for row in rows)


def test_a_contact_of_metrics_is_a_contact_of_the_run():
    """Cubes of 1 m touch but in every fourth of 40 frames, ten times: contacts a minute times the minutes are ten."""
    apart_in_every_fourth = [0.9 if frame % 4 else 3.0 for frame in range(40)]
    result = run(unit_cubes_on_x({"a": [0.0] * 40, "b": apart_in_every_fourth}), detectors="hybrid", oracle="exact")
    counts = {row["detector"]: row["contacts_per_min"] * row["valid_minutes"] for row in metric_rows(result)}
    assert counts == pytest.approx({"hybrid": 10, "exact": 10})
    assert {label: len(contacts) for label, contacts in result.episodes.items()} == {"hybrid": 10, "exact": 10}
    assert result.document.audit["hybrid"].contacts == 10


@pytest.mark.slow
@pytest.mark.parametrize("oracle", ["exact", "none"])
def test_contacts_per_minute_leave_out_contacts_of_a_grasped_body(oracle):
    """The hand reaches the cube at 1 s, carries it for a second while its trigger is pressed, and lets go.

    The cube also meets a ball, from 0.2 to 0.3 s: each detector has two contacts, of which only this one counts.
    """
    seconds = np.arange(300) * 0.01
    cube = 0.5 * np.clip(seconds - 1.0, 0.0, 1.0)
    hand = np.where(seconds < 1.0, -3.0 + 2.0 * seconds, cube - 0.95)
    ball = np.where((seconds > 0.2) & (seconds < 0.3), 0.9, 9.0)
    trigger = ((seconds >= 1.0) & (seconds < 2.0)).astype(float)
    hands = {"p/right": HandTrack(np.arange(300) * 10_000_000, trigger)}
    session = replace(unit_cubes_on_x({"hand-right": hand, "cube": cube, "ball": ball}), hands=hands)
    result = run(session, detectors="hull50", oracle=oracle)
    counts = {row["detector"]: row["contacts_per_min"] * row["valid_minutes"] for row in metric_rows(result)}
    assert {label: len(contacts) for label, contacts in result.episodes.items()} == dict.fromkeys(counts, 2)
    assert counts == pytest.approx(dict.fromkeys(counts, 1))
    in_a_hand = result.tables["episodes"].column("held")
    assert in_a_hand.count(True) == in_a_hand.count(False) == len(counts)


@pytest.mark.parametrize(
    ("pair", "start", "fixed_bodies", "grasps", "expected"),
    [
        pytest.param(HAND_AND_BEAKER, 5.0, set(), (GRASPS_BEAKER,), True, id="hand on what it grasps"),
        pytest.param(HAND_AND_BEAKER, 3.6, set(), (GRASPS_BEAKER,), True, id="as it reaches for it"),
        pytest.param(HAND_AND_BEAKER, 3.0, set(), (GRASPS_BEAKER,), False, id="long before"),
        pytest.param(HAND_AND_BEAKER, 6.4, set(), (GRASPS_BEAKER,), True, id="as it lets go"),
        pytest.param(HAND_AND_BEAKER, 7.1, set(), (GRASPS_BEAKER,), False, id="long after"),
        pytest.param(HAND_AND_TABLE, 5.0, set(), (GRASPS_BEAKER,), False, id="hand on another body"),
        pytest.param(HAND_AND_TABLE, 5.0, set(), (GRASPS_NOTHING,), True, id="hand that grasps at nothing"),
        pytest.param(BEAKER_AND_TABLE, 5.0, set(), (GRASPS_BEAKER,), False, id="two bodies without the hand"),
        pytest.param(BEAKER_AND_TABLE, 5.0, {TABLE}, (), True, id="body on a fixed one, which carries it"),
    ],
)
def test_contacts_that_belong_to_the_work(pair, start, fixed_bodies, grasps, expected):
    """A contact of 0.1 s from ``start`` on is meant if the hand grasps from 4 to 6 s, or within 0.5 s of that."""
    contact = Episode(pair, first=0, last=0, start=start, end=start + 0.1)
    assert is_intended(contact, PAIRS, fixed_bodies, {HAND: "right"}, grasps) is expected


@pytest.fixture(scope="module")
def run_without_effects():
    """A run of nine frames of 10 ms: it ends at 0.08 s."""
    session = unit_cubes_on_x({"a": [0.0] * 9, "b": list(np.linspace(3, 4, 9))})
    return run(session, detectors="hybrid", oracle="none")


def test_metrics_of_effects_that_nobody_measured_are_null(run_without_effects):
    """A run without effects: nothing looked for breakages, spills or hazards, so that these are not 0."""
    assert effect_metrics(run_without_effects) == {"breakages": None, "spilled_ml": None, "hazard_seconds": None}


def test_metrics_of_effects_are_sums_of_their_events(run_without_effects):
    """Spills of 2.0 and 0.5 mL; a body that is hit and breaks, one breakage.

    A hazard is near from 0.01 to 0.04 s, and again from 0.06 s to the end of the recording, at 0.08 s.
    """
    events = {
        "pour": [EffectEvent(0.01, "spill", values={"volume_ml": volume}) for volume in (2.0, 0.5)],
        "hazard-proximity": [EffectEvent(0.01, "near", end=0.04), EffectEvent(0.06, "near")],
        "breakage": [EffectEvent(0.01, "impact"), EffectEvent(0.01, "broken")],
    }
    effects = {kind: SimpleNamespace(events=events_of_kind) for kind, events_of_kind in events.items()}
    metrics = effect_metrics(replace(run_without_effects, effects=effects))
    assert (metrics["breakages"], metrics["spilled_ml"]) == (1, 2.5)
    assert metrics["hazard_seconds"] == pytest.approx((0.04 - 0.01) + (0.08 - 0.06))


class UnreadableTracks(dict):
    """Tracks of hands of which any use fails."""

    def __bool__(self):
        raise AssertionError("the topic of hands was read")

    __iter__ = items = values = keys = __getitem__ = __bool__


def test_a_scene_of_effects_counts_no_grasp_or_breakage():
    """The scene declares a pour alone, from glass a into b: tracks of hands are not read; metrics are null, not 0."""
    glasses = (glass("a", volume_ml=60.0), glass("b"))
    session = session_with_effects(
        {"a": poses_of_tilted_glass([0.0, 60.0, 60.0]), "b": poses_at_rest(count=3)},  # degrees in three frames
        glasses,
        ("pour", {"from": ["a"], "into": ["b"]}),
    )
    object.__setattr__(session, "hands", UnreadableTracks())
    (row,) = metric_rows(compute(session))
    assert (row["grasps"], row["grasp_attempts"], row["breakages"]) == (None, None, None)
