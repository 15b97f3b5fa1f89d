"""Advice in an engine's words counts as the audit counts, and says what could not be tried."""

from dataclasses import replace

import pytest
from support.small_worlds import cube, unit_cubes_on_x

import replay
from cdcore.protocol import Verdict
from replay.errors import AuditError, TradeoffError
from replay.running import advisor
from sessions import MeshData

POSITIONS = {
    "a": [0] * 24,
    "b": [3, 3, 0.9, 3, 3, 3, 3, 3, 0.9, 0.8, 0.9, 3, 3, 1.015, 3, 3, 0.9, 0.9, 3, 3, 3, 3, 0.9, 3],
}
"""Metres on X of two unit cubes: four contacts, of 1, 3, 2 and 1 frames, and once a gap of 15 mm."""


@pytest.fixture
def without_engines(monkeypatch):
    """Hides the extra `engines`, as if it were not installed."""
    monkeypatch.setattr(advisor, "find_spec", lambda name: None)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["unity", "unreal"])
def test_each_advised_setting_has_the_counts_of_its_audit(engine, without_engines):
    """The first and the last row of the advice, each beside a run of its setting."""
    session = unit_cubes_on_x(POSITIONS)
    advice = replay.advise(session, engine=engine)
    assert advice.rows[0]["number"] == 1 and len(advice.rows) >= 2
    for row in (advice.rows[0], advice.rows[-1]):
        alone = replay.run(session, detectors=f"it={row['setting']}")
        counts, audit = alone.counts["it"], alone.document.audit["it"]
        assert row["contacts"] == counts.contacts
        ranges = audit.counts_over_offsets
        for name, counted in (("missed", ranges.contacts_missed), ("late", ranges.late_or_cut_short)):
            assert all(row[f"{name}_{end}"] == getattr(counted, end) for end in ("smallest", "largest"))
        if audit.means_over_offsets is None:
            assert [row["missed"], row["late"]] == [counts.missed, counts.late_or_cut_short]
        assert row["false"] == audit.false_contact_mean.value
        assert row["ms"] > 0 and row["p99_ms"] > 0


def test_recorded_colliders_get_a_row_distinct_from_hulls(without_engines):
    """A collider of half the size has contact below 0.75 m: at 0.7 and not at 0.9, where hull and cube have it."""
    half = tuple(MeshData(0.5 * cube().vertices, cube().faces) for _ in "x")
    positions = {"a": [0] * 90, "b": [3] * 30 + [0.9] * 20 + [0.7] * 10 + [3] * 30}
    session = replace(unit_cubes_on_x(positions, step_ns=11_111_111), colliders={"a": half})
    bare = replay.advise(unit_cubes_on_x(positions, step_ns=11_111_111), engine="unreal")
    assert not any("shipped" in row["setting"] for row in bare.rows)
    advice = replay.advise(session, engine="unreal")
    (row,) = [row for row in advice.rows if "shipped" in row["setting"]]
    assert row["knobs"] == {"Collision Complexity": "simple, those recorded"}
    assert (row["contacts"], row["missed"], row["late"]) == (1, 0, 1) and row["false"] == 0
    best, *_ = advice.rows
    assert best["late"] == 0
    run = replay.run(session, detectors="it=collider[shape=shipped]")
    assert int((run.detections["it"].verdict == Verdict.CONTACT).sum()) == 10


def test_engine_that_is_not_installed_is_one_clear_error(without_engines):
    """Unreal's colliders can be tried without Unreal, with 16 pieces at two step rates; MuJoCo's cannot."""
    advice = replay.advise(unit_cubes_on_x(POSITIONS), engine="unreal")
    assert sum("pieces=16" in row["setting"] for row in advice.rows) == 2
    with pytest.raises(TradeoffError, match=r"^mujoco itself is needed and is not installed; pip install "):
        replay.advise(unit_cubes_on_x(POSITIONS), engine="mujoco")


def test_advice_for_a_faultless_session_calls_row_1_right(without_engines):
    """The cubes touch in 30 of 90 frames at 90 Hz, long enough for every step rate.

    With row 2 as the reference three rows are left to advise; without a reference there is no advice.
    """
    positions = {"a": [0] * 90, "b": [3] * 30 + [0.9] * 30 + [3] * 30}
    session = unit_cubes_on_x(positions, step_ns=11_111_111)
    assert replay.advise(session, engine="unreal").sentences[0] == "Row 1 gets each of 1 contact right."
    assert [row["number"] for row in replay.advise(session, engine="unreal", oracle="row-2").rows] == [1, 3, 4]
    with pytest.raises(AuditError, match="needs a reference"):
        replay.advise(session, engine="unreal", oracle="none")
