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

PAIRS_OF_THREE = np.array([[0, 1], [1, 2], [0, 2]])
HANDS = {0: "right"}


@pytest.fixture(scope="module")
def silver_chloride_run():
    """A run over the made-up experiment, and what was planted in it."""
    session, truth = make_scene_session("silver-chloride", seed=1, faces=500)
    return run(session, detectors="slow=discrete[rate_hz=30],hybrid", oracle="exact"), truth


@pytest.fixture(scope="module")
def rows_by_detector(silver_chloride_run):
    """Rows of metrics by the label of their detector."""
    result, _ = silver_chloride_run
    return {row["detector"]: row for row in metric_rows(result)}


def facts_of_kind(truth, kind):
    """The planted facts of a kind."""
    return [fact for fact in truth.facts if fact.kind == kind]


def test_metrics_of_a_made_up_session_equal_planted_counts(silver_chloride_run, rows_by_detector):
    """The session's generator wrote down each grasp, near miss and contact that it planted."""
    (_, truth), row = silver_chloride_run, rows_by_detector["exact"]
    assert row["grasps"] == row["grasp_attempts"] == len(facts_of_kind(truth, "grasp")) > 0
    assert row["near_misses"] == len(facts_of_kind(truth, "near_miss")) == 1
    assert row["breakages"] is None  # the scene asks nobody to look
    planted = [episode for episode in truth.episodes if episode.kind == "contact" and episode.surely]
    contacts = row["contacts_per_min"] * row["valid_minutes"]
    assert len(planted) <= round(contacts) <= len([e for e in truth.episodes if e.nominal])
    assert row["valid_minutes"] == pytest.approx(truth.seconds / 60, rel=0.02)
    assert row["task_seconds"] == pytest.approx(sum(v for k, v in row.items() if k.startswith(TASK_COLUMN_PREFIX)))


def test_a_row_has_the_recall_that_the_audit_measured(silver_chloride_run, rows_by_detector):
    """Recall is the fraction of the reference's pair-frames in contact that a detector reports; ``slow`` has 30 Hz."""
    result, _ = silver_chloride_run
    assert set(rows_by_detector) == {"slow", "hybrid", "exact"}
    assert rows_by_detector["exact"]["recall"] == 1.0 and 0.0 < rows_by_detector["slow"]["recall"] < 1.0
    pair_frames = result.document.audit["slow"].pair_frames
    assert rows_by_detector["slow"]["recall"] == pair_frames.both / (pair_frames.both + pair_frames.missed)
    assert {row["contact_frames"] for row in rows_by_detector.values()} == {pair_frames.both + pair_frames.missed}
    assert len({row["session"] for row in rows_by_detector.values()}) == 1
    assert len({row["settings"] for row in rows_by_detector.values()}) == 3


@pytest.mark.parametrize(
    ("positions", "detectors", "oracle", "reported"),
    [
        (np.linspace(3, 4, 9), "hybrid", "exact", [("hybrid", None, 0, 0.0), ("exact", None, 0, 0.0)]),
        (np.linspace(3, 4, 9), "hybrid", "none", [("hybrid", None, None, 0.0)]),
        (np.linspace(3, 4, 9), (), None, [("none", None, None, None)]),
    ],
    ids=["no contact", "no oracle", "no detector"],
)
def test_recall_is_absent_without_contact_oracle_or_detector(positions, detectors, oracle, reported):
    """Cubes 3 m apart never touch. Rows: detector, recall, frames of contact, contacts a minute."""
    rows = metric_rows(run(unit_cubes_on_x({"a": [0.0] * 9, "b": list(positions)}), detectors=detectors, oracle=oracle))
    keys = ("detector", "recall", "contact_frames", "contacts_per_min")
    assert [tuple(row[key] for key in keys) for row in rows] == reported and all(
        row["valid_minutes"] > 0 for row in rows
    )


def test_a_contact_of_metrics_is_a_contact_of_the_run():
    """Contacts a minute times the minutes are the contacts of each detector, ten."""
    touching = [0.9 if frame % 4 else 3.0 for frame in range(40)]  # apart for a frame, ten times
    result = run(unit_cubes_on_x({"a": [0.0] * 40, "b": touching}), detectors="hybrid", oracle="exact")
    minutes = metric_rows(result)[0]["valid_minutes"]
    counts = {row["detector"]: row["contacts_per_min"] * minutes for row in metric_rows(result)}
    assert counts == pytest.approx({label: len(actual) for label, actual in result.episodes.items()})
    assert counts["exact"] == pytest.approx(10) == result.document.audit["hybrid"].contacts


@pytest.mark.slow
@pytest.mark.parametrize("oracle", ["exact", "none"])
def test_contacts_per_minute_leave_out_contacts_of_a_grasped_body(oracle):
    """The hand touches the cube, carries it while its trigger is pressed, and lets go; once the cube meets the ball."""
    time = np.arange(300) * 0.01
    cube = 0.5 * np.clip(time - 1.0, 0.0, 1.0)
    hand = np.where(time < 1.0, -3.0 + 2.0 * time, cube - 0.95)
    ball = np.where((time > 0.2) & (time < 0.3), 0.9, 9.0)
    trigger = ((time >= 1.0) & (time < 2.0)).astype(float)
    hands = {"p/right": HandTrack(np.arange(300) * 10_000_000, trigger)}
    session = replace(unit_cubes_on_x({"hand-right": hand, "cube": cube, "ball": ball}), hands=hands)
    result = run(session, detectors="hull50", oracle=oracle)
    counts = {row["detector"]: row["contacts_per_min"] * row["valid_minutes"] for row in metric_rows(result)}
    assert {label: len(contacts) for label, contacts in result.episodes.items()} == dict.fromkeys(counts, 2)
    assert counts == pytest.approx(dict.fromkeys(counts, 1))
    held = result.tables["episodes"].column("held")
    assert held.count(True) == held.count(False) == len(counts)


@pytest.mark.parametrize(
    "pair, start, fixed, taken, expected",
    [
        (0, 5.0, set(), (Grasp(hand=0, start=4.0, end=6.0, thing=1),), True),  # the hand on what it holds
        (0, 3.6, set(), (Grasp(hand=0, start=4.0, end=6.0, thing=1),), True),  # as it reaches for it
        (0, 3.0, set(), (Grasp(hand=0, start=4.0, end=6.0, thing=1),), False),  # long before
        (0, 6.4, set(), (Grasp(hand=0, start=4.0, end=6.0, thing=1),), True),  # as it lets go
        (0, 7.1, set(), (Grasp(hand=0, start=4.0, end=6.0, thing=1),), False),  # long after
        (2, 5.0, set(), (Grasp(hand=0, start=4.0, end=6.0, thing=1),), False),  # on another thing
        (2, 5.0, set(), (Grasp(hand=0, start=4.0, end=6.0, thing=-1),), True),  # a grasp that failed
        (1, 5.0, set(), (Grasp(hand=0, start=4.0, end=6.0, thing=1),), False),  # two things against each other
        (1, 5.0, {2}, (), True),  # a thing on what carries it
    ],
)
def test_contacts_that_belong_to_the_work(pair, start, fixed, taken, expected):
    """Body 0 is the hand; pair 0 is the hand and body 1, pair 1 bodies 1 and 2, pair 2 the hand and body 2."""
    assert (
        is_intended(Episode(pair, first=0, last=0, start=start, end=start + 0.1), PAIRS_OF_THREE, fixed, HANDS, taken)
        is expected
    )


def test_metrics_of_effects_are_sums_or_null():
    """Frames of 10 ms: a hazard from 0.01 to 0.04 s, and one from 0.06 s to the end at 0.08 s."""
    result = run(unit_cubes_on_x({"a": [0.0] * 9, "b": list(np.linspace(3, 4, 9))}), detectors="hybrid", oracle="none")
    assert effect_metrics(result) == {"breakages": None, "spilled_ml": None, "hazard_seconds": None}
    effects = {
        "pour": [EffectEvent(0.01, "spill", values={"volume_ml": volume}) for volume in (2.0, 0.5)],
        "hazard-proximity": [EffectEvent(0.01, "near", end=0.04), EffectEvent(0.06, "near")],
        "breakage": [EffectEvent(0.01, "impact"), EffectEvent(0.01, "broken")],
    }
    effects = {kind: SimpleNamespace(events=events) for kind, events in effects.items()}
    reported = effect_metrics(replace(result, effects=effects))
    assert (reported["breakages"], reported["spilled_ml"]) == (1, 2.5)
    assert reported["hazard_seconds"] == pytest.approx(0.03 + 0.02)


class Unread(dict):
    """Tracks of hands that nobody may look at."""

    def __bool__(self):
        raise AssertionError("the topic of hands was read")

    __iter__ = items = values = keys = __getitem__ = __bool__


def test_a_scene_of_effects_counts_no_grasp_or_breakage():
    """The scene declares a pour alone: nobody reads the tracks of hands, and the metrics are null, not 0."""
    glasses = (glass("a", volume_ml=60.0), glass("b"))
    session = session_with_effects(
        {"a": poses_of_tilted_glass([0.0, 60.0, 60.0]), "b": poses_at_rest(count=3)},
        glasses,
        ("pour", {"from": ["a"], "into": ["b"]}),
    )
    object.__setattr__(session, "hands", Unread())
    (row,) = metric_rows(compute(session))
    assert [row[key] for key in ("grasps", "grasp_attempts", "breakages")] == [None] * 3
