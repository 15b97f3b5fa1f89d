import pytest
from support.small_worlds import cubes

from replay.api.auditor import AuditResult, audit
from replay.errors import AuditError, OutputError
from sessions import write_session

BUMP = {"a": [0] * 12, "b": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3]}
SLOW = "slow=discrete[rate_hz=20]"


def test_the_public_name_is_callable_though_a_package_has_it():
    import replay.comparison.compare

    found = replay.audit(cubes(BUMP), detectors=SLOW)
    assert isinstance(found, AuditResult)
    from replay import audit as again

    assert again(cubes(BUMP), detectors=SLOW).summary["slow"]["misses"] == 2


def test_several_sessions_are_summed_and_keep_their_own_runs():
    found = audit([cubes(BUMP), cubes(BUMP)], detectors=[SLOW, "hybrid"])
    assert len(found.results) == 2 and set(found.summary) == {"slow", "hybrid"}
    assert found.summary["slow"]["episodes"]["truth"] == 4
    assert found.summary["slow"]["missed"]["of"] == 8


def test_all_detectors_share_one_run_folder_and_sessions_have_one_each(tmp_path):
    for name in ("p", "q"):
        write_session(cubes(BUMP), tmp_path / f"{name}.mcap")
    files = [tmp_path / "p.mcap", tmp_path / "q.mcap"]
    audit(files[0], detectors=[SLOW, "hybrid"], out=tmp_path / "one", picture=False)
    assert (tmp_path / "one" / "summary.json").is_file()
    found = audit(files, detectors=SLOW, out=tmp_path / "two", picture=False)
    assert [result.out for result in found.results] == [tmp_path / "two" / "p", tmp_path / "two" / "q"]


def test_two_sessions_that_would_share_a_run_folder_are_refused(tmp_path):
    with pytest.raises(AuditError, match="two sessions are called 'p'"):
        audit(["a/p.mcap", "b/p.mcap"], out=tmp_path / "x")


def test_a_folder_in_the_way_of_one_of_several_is_refused_before_any_work(tmp_path):
    for name in ("p", "q"):
        write_session(cubes(BUMP), tmp_path / f"{name}.mcap")
    (tmp_path / "out" / "q").mkdir(parents=True)
    with pytest.raises(OutputError, match="q exists"):
        audit([tmp_path / "p.mcap", tmp_path / "q.mcap"], out=tmp_path / "out")
    assert not (tmp_path / "out" / "p").exists()


def test_limits_hold_for_all_sessions_together():
    sessions = [cubes(BUMP), cubes({"a": [0] * 12, "b": [3 + k / 10 for k in range(12)]})]
    assert audit(sessions, detectors=SLOW, max_missed=0.9, max_invented=1.0).broken == ()
    broken = audit(sessions, detectors=SLOW, max_missed=0.4).broken
    assert any("slow missed contacts" in sentence for sentence in broken)
    with pytest.raises(AuditError, match="share"):
        audit(sessions, max_missed=50)
