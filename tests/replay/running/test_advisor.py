"""Advice in an engine's words counts as the audit counts, and says what could not be tried."""

from dataclasses import replace

import pytest
from support.small_worlds import cube, unit_cubes_on_x

import replay
from cdcore.protocol import Verdict
from replay.errors import AuditError, TradeoffError
from replay.running import advisor
from sessions import MeshData

X_OF_CUBES = {
    "a": [0] * 24,
    "b": [3, 3, 0.9, 3, 3, 3, 3, 3, 0.9, 0.8, 0.9, 3, 3, 1.015, 3, 3, 0.9, 0.9, 3, 3, 3, 3, 0.9, 3],
}
"""Metres on X of two cubes of 1 m, frame by frame of 10 ms: four contacts, of 1, 3, 2 and 1 frames.

In frame 13 they are 15 mm apart.
"""


@pytest.fixture
def without_engines(monkeypatch):
    """Hides the packages of physics engines, the extra `engines`, as if it were not installed."""
    monkeypatch.setattr(advisor, "find_spec", lambda name: None)


@pytest.fixture(scope="module")
def unreal_advice():
    """Advice which settings to use in Unreal, without any engine, for two cubes with four contacts."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(advisor, "find_spec", lambda name: None)
        return replay.advise(unit_cubes_on_x(X_OF_CUBES), engine="unreal")


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["unity", "unreal"])
def test_each_advised_setting_has_the_counts_of_its_audit(engine, without_engines):
    """Two cubes touch four times: the first and the last row of the advice, each beside a run of its setting alone.

    Missed and late contacts are smallest, largest and mean over sampling offsets; without offsets those of the run.
    """
    session = unit_cubes_on_x(X_OF_CUBES)
    advice = replay.advise(session, engine=engine)
    assert advice.rows[0]["number"] == 1 and len(advice.rows) >= 2
    for row in (advice.rows[0], advice.rows[-1]):
        alone = replay.run(session, detectors=f"it={row['setting']}")
        counts, audit = alone.counts["it"], alone.document.audit["it"]
        assert row["contacts"] == counts.contacts
        missed, late = audit.counts_over_offsets.contacts_missed, audit.counts_over_offsets.late_or_cut_short
        assert (row["missed_smallest"], row["missed_largest"]) == (missed.smallest, missed.largest)
        assert (row["late_smallest"], row["late_largest"]) == (late.smallest, late.largest)
        if audit.means_over_offsets is None:
            assert [row["missed"], row["late"]] == [counts.missed, counts.late_or_cut_short]
        assert row["false"] == audit.false_contact_mean.value
        assert row["ms"] > 0 and row["p99_ms"] > 0


HEADSET_STEP_NS = 11_111_111
"""Nanoseconds between frames of 90 Hz."""


def test_recorded_colliders_get_a_row_of_their_own(without_engines):
    """Cubes of 1 m are 0.9 m from each other in 20 frames, then 0.7 m in 10.

    The recording has a collider of half the size for body a, which touches b from 0.75 m on: late for the contact.
    """
    half_cube = MeshData(0.5 * cube().vertices, cube().faces)
    positions = {"a": [0] * 90, "b": [3] * 30 + [0.9] * 20 + [0.7] * 10 + [3] * 30}
    session = replace(unit_cubes_on_x(positions, step_ns=HEADSET_STEP_NS), colliders={"a": (half_cube,)})
    advice = replay.advise(session, engine="unreal")
    (row,) = [row for row in advice.rows if "shipped" in row["setting"]]
    assert row["knobs"] == {"Collision Complexity": "simple, those recorded"}
    assert (row["contacts"], row["missed"], row["late"], row["false"]) == (1, 0, 1, 0)
    best, *_ = advice.rows
    assert best["late"] == 0
    run = replay.run(session, detectors="it=collider[shape=shipped]")
    assert int((run.detections["it"].verdict == Verdict.CONTACT).sum()) == 10


def test_recording_without_colliders_has_no_row_of_them(unreal_advice):
    """Settings of Unreal for two cubes; ``shape=shipped`` are colliders in a recording, of which this one has none."""
    assert unreal_advice.rows
    assert [row["setting"] for row in unreal_advice.rows if "shipped" in row["setting"]] == []


def test_engine_that_is_not_installed_is_one_clear_error(without_engines):
    """Settings of MuJoCo are tried by MuJoCo itself, which seems not to be installed."""
    with pytest.raises(TradeoffError, match=r"^mujoco itself is needed and is not installed; pip install "):
        replay.advise(unit_cubes_on_x(X_OF_CUBES), engine="mujoco")


def test_unreals_colliders_are_tried_without_unreal(unreal_advice):
    """No engine is installed: the tool itself tries up to 16 convex pieces a body, at 90 and at 30 steps a second."""
    assert len([row for row in unreal_advice.rows if "pieces=16" in row["setting"]]) == 2


@pytest.fixture
def session_with_long_contact():
    """Two cubes that touch in 30 of 40 frames at 90 Hz, long enough for every step rate of an engine."""
    positions = {"a": [0] * 40, "b": [3] * 5 + [0.9] * 30 + [3] * 5}
    return unit_cubes_on_x(positions, step_ns=HEADSET_STEP_NS)


def test_advice_for_a_faultless_session_calls_row_1_right(without_engines, session_with_long_contact):
    """Two cubes touch for 30 frames, which every setting of Unreal sees: of equal ones the first is advised."""
    advice = replay.advise(session_with_long_contact, engine="unreal")
    assert advice.sentences[0] == "Row 1 gets each of 1 contact right."


def test_reference_of_the_advice_is_no_row_of_it(without_engines, session_with_long_contact):
    """Unreal has four settings; with the second as the reference (``oracle``) three are left to advise."""
    advice = replay.advise(session_with_long_contact, engine="unreal", oracle="row-2")
    assert [row["number"] for row in advice.rows] == [1, 3, 4]


def test_advice_without_a_reference_is_refused(session_with_long_contact):
    """Settings could not be compared with anything."""
    with pytest.raises(AuditError, match="needs a reference"):
        replay.advise(session_with_long_contact, engine="unreal", oracle="none")
