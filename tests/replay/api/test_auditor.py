import pytest
from support.small_worlds import cubes

import replay
from replay.api.auditor import AuditResult, audit
from replay.errors import AuditError, OutputError
from sessions import write_session
from sessions.errors import SessionFileError

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


def test_what_cannot_be_audited_is_refused(tmp_path):
    with pytest.raises(AuditError, match="no session"):
        audit([])
    with pytest.raises(AuditError, match="needs an oracle"):
        audit(cubes(BUMP), oracle="none")
    with pytest.raises(AuditError, match="two sessions are called 'p'"):
        audit(["a/p.mcap", "b/p.mcap"], out=tmp_path / "x")


PLACES = {"a": [0] * 6, "b": [3, 3, 0.9, 3, 3, 3]}


def test_a_session_and_its_file_give_the_same_digests(tmp_path):
    session = cubes(PLACES)
    write_session(session, tmp_path / "s.mcap")
    results = [
        replay.run(given, detectors="hybrid") for given in (session, tmp_path / "s.mcap", str(tmp_path / "s.mcap"))
    ]
    digests = {result.detections["hybrid"].digest for result in results}
    assert len(digests) == 1 and results[0].out is None


def test_out_makes_a_run_folder_with_its_picture(tmp_path):
    result = replay.run(cubes(PLACES), detectors="sphere", oracle="hybrid", out=tmp_path / "run")
    assert result.out == tmp_path / "run"
    assert (result.out / "run.rrd").stat().st_size > 1000 and (result.out / "summary.json").is_file()
    bare = replay.run(cubes(PLACES), detectors="hybrid", out=str(tmp_path / "bare"), picture=False)
    assert not (bare.out / "run.rrd").exists()


def test_a_folder_in_the_way_is_refused_before_any_work(tmp_path):
    with pytest.raises(OutputError, match="--force"):
        replay.run(tmp_path / "missing.mcap", out=tmp_path)
    with pytest.raises(SessionFileError):
        replay.run(tmp_path / "missing.mcap")


def test_the_package_says_what_it_has():
    assert {"run", "plan", "RunResult"} <= set(dir(replay))
    with pytest.raises(AttributeError, match="it has: run"):
        _ = replay.rum
