import pytest
from support.small_worlds import MEET_IN_4_AND_8_TO_10, unit_cubes_on_x

import replay
from replay.errors import AuditError, OutputError
from replay.running.auditor import AuditResult
from sessions import write_session

SLOW = "slow=discrete[rate_hz=20]"
"""A detector that samples every fifth frame, and misses the contact of one frame."""


@pytest.fixture
def two_session_files(tmp_path):
    """The files p.mcap and q.mcap of one session, of two contacts."""
    files = [tmp_path / "p.mcap", tmp_path / "q.mcap"]
    for file in files:
        write_session(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), file)
    return files


@pytest.mark.slow
def test_audit_of_two_sessions_sums_their_counts():
    """Each session has two contacts, of one and of three frames: together 4 contacts of 8 frames.

    ``slow`` samples every fifth frame and misses some of them, as many in either session.
    """
    session = unit_cubes_on_x(MEET_IN_4_AND_8_TO_10)
    result = replay.audit([session, session], detectors=[SLOW, "hybrid"])
    assert isinstance(result, AuditResult)
    assert len(result.results) == 2
    assert set(result.audit) == {"slow", "hybrid"}
    slow, slow_in_one_session = result.audit["slow"], replay.audit(session, detectors=SLOW).audit["slow"]
    assert slow.misses == 2 * slow_in_one_session.misses > 0
    assert slow.matching.reference_contacts == 2 * 2
    assert slow.time_missed.of == 2 * (1 + 3)


def test_detectors_have_a_common_run_folder(two_session_files, tmp_path):
    """One session by two detectors: ``out`` is the run folder."""
    replay.audit(two_session_files[0], detectors=[SLOW, "hybrid"], out=tmp_path / "out", picture=False)
    assert (tmp_path / "out" / "summary.json").is_file()


def test_sessions_have_run_folders_of_their_own(two_session_files, tmp_path):
    """Two sessions by one detector: the run folders in ``out`` are called as the files, p and q."""
    result = replay.audit(two_session_files, detectors=SLOW, out=tmp_path / "out", picture=False)
    assert [run.out for run in result.results] == [tmp_path / "out" / "p", tmp_path / "out" / "q"]


def test_two_sessions_of_a_name_are_refused_before_any_work(tmp_path):
    """Both would be written to the run folder p; the files are not even there."""
    with pytest.raises(AuditError, match="two sessions are called 'p'"):
        replay.audit(["a/p.mcap", "b/p.mcap"], out=tmp_path / "out")


def test_existing_run_folder_is_refused_before_any_work(two_session_files, tmp_path):
    """The run folder of q exists, so that the one of p, the session before it, is not begun."""
    (tmp_path / "out" / "q").mkdir(parents=True)
    with pytest.raises(OutputError, match="q exists"):
        replay.audit(two_session_files, out=tmp_path / "out")
    assert not (tmp_path / "out" / "p").exists()


def test_limits_hold_for_all_sessions_together():
    """One of two sessions has no contact, so the other's misses decide: about 0.6 of its two contacts.

    ``slow`` samples every fifth frame: over all offsets of its first sample it misses the contact of one frame in 4 of
    5, that of three frames in 2 of 5. A gate on false contact that allows all of it never breaks.
    """
    without_contact = {"a": [0] * 12, "b": [3 + k / 10 for k in range(12)]}
    sessions = [unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), unit_cubes_on_x(without_contact)]
    assert replay.audit(sessions, detectors=SLOW, max_missed=0.9, max_false=1.0).broken == ()
    broken = replay.audit(sessions, detectors=SLOW, max_missed=0.4).broken
    assert any("slow missed contacts" in sentence for sentence in broken)


def test_limit_in_percent_is_refused():
    """A limit is a fraction, so that 50 % are 0.5."""
    with pytest.raises(AuditError, match="max_missed is 50; give a share from 0 to 1"):
        replay.audit([unit_cubes_on_x(MEET_IN_4_AND_8_TO_10)], max_missed=50)
