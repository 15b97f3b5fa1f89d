import pytest
from support.small_worlds import MEET_IN_4_AND_8_TO_10, unit_cubes_on_x

import replay
from replay.errors import AuditError, OutputError
from replay.running.auditor import AuditResult
from sessions import write_session

SLOW = "slow=discrete[rate_hz=20]"


@pytest.fixture
def two_session_files(tmp_path):
    """Two files of one session."""
    for name in ("p", "q"):
        write_session(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), tmp_path / f"{name}.mcap")
    return [tmp_path / "p.mcap", tmp_path / "q.mcap"]


@pytest.mark.slow
def test_audit_of_two_sessions_sums_their_counts():
    """Each session has two contacts, of one and of three frames: together 4 contacts of 8 frames."""
    result = replay.audit(
        [unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), unit_cubes_on_x(MEET_IN_4_AND_8_TO_10)], detectors=[SLOW, "hybrid"]
    )
    assert isinstance(result, AuditResult) and len(result.results) == 2 and set(result.audit) == {"slow", "hybrid"}
    assert (
        result.audit["slow"].misses
        == 2 * replay.audit(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), detectors=SLOW).audit["slow"].misses
    )
    assert result.audit["slow"].matching.reference_contacts == 4 and result.audit["slow"].time_missed.of == 8


def test_detectors_have_a_common_run_folder_and_sessions_separate(two_session_files, tmp_path):
    """One session by two detectors, then the sessions p and q by one."""
    replay.audit(two_session_files[0], detectors=[SLOW, "hybrid"], out=tmp_path / "one", picture=False)
    assert (tmp_path / "one" / "summary.json").is_file()
    matches = replay.audit(two_session_files, detectors=SLOW, out=tmp_path / "two", picture=False)
    assert [result.out for result in matches.results] == [tmp_path / "two" / "p", tmp_path / "two" / "q"]


def test_existing_or_shared_folder_is_refused_before_any_work(two_session_files, tmp_path):
    """Both sessions called p would be written to one folder; of p and q the folder of q exists, and p is not begun."""
    with pytest.raises(AuditError, match="two sessions are called 'p'"):
        replay.audit(["a/p.mcap", "b/p.mcap"], out=tmp_path / "x")
    (tmp_path / "out" / "q").mkdir(parents=True)
    with pytest.raises(OutputError, match="q exists"):
        replay.audit(two_session_files, out=tmp_path / "out")
    assert not (tmp_path / "out" / "p").exists()


def test_limits_hold_for_all_sessions_together():
    """One of two sessions has no contact, so the other's misses decide: fewer than 0.9 and more than 0.4 of all.

    A limit is a fraction, so that 50 is refused.
    """
    sessions = [
        unit_cubes_on_x(MEET_IN_4_AND_8_TO_10),
        unit_cubes_on_x({"a": [0] * 12, "b": [3 + k / 10 for k in range(12)]}),
    ]
    assert replay.audit(sessions, detectors=SLOW, max_missed=0.9, max_false=1.0).broken == ()
    broken = replay.audit(sessions, detectors=SLOW, max_missed=0.4).broken
    assert any("slow missed contacts" in sentence for sentence in broken)
    with pytest.raises(AuditError, match="max_missed is 50; give a share from 0 to 1"):
        replay.audit(sessions, max_missed=50)
