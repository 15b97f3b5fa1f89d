import pickle
from importlib.util import find_spec
from types import SimpleNamespace

import pytest
from support.small_worlds import cubes

from replay.api import batch
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


def test_what_cannot_be_audited_is_refused(tmp_path):
    with pytest.raises(AuditError, match="no session"):
        audit([])
    with pytest.raises(AuditError, match="needs an oracle"):
        audit(cubes(BUMP), oracle="none")
    with pytest.raises(AuditError, match="two sessions are called 'p'"):
        audit(["a/p.mcap", "b/p.mcap"], out=tmp_path / "x")


@pytest.mark.parametrize(
    ("given", "more", "elsewhere"),
    [(2, {}, False), (2, {"jobs": 2}, True), (1, {"jobs": 2}, False), (1, {"scheduler": "local"}, True)],
)
def test_others_are_asked_for_several_sessions_or_where_a_scheduler_is_named(monkeypatch, given, more, elsewhere):
    asked = []
    alone = SimpleNamespace(summary={"audit": {}})
    monkeypatch.setattr(batch, "run_side_by_side", lambda tasks, *_: asked.append([*tasks]) or (alone,))
    monkeypatch.setattr(batch, "run_near", lambda *_: alone)
    audit([cubes(BUMP)] * given, detectors=SLOW, **more)
    assert [len(names) for names in asked] == ([given] if elsewhere else [])


@pytest.mark.slow
def test_sessions_side_by_side_give_what_they_give_one_by_one(tmp_path):
    """Everything that `replay audit` prints of them, but times."""
    from replay.cli.run_report import run_json
    from replay.cli.run_tables import fault_tables
    from replay.pipeline.headline import beside, headlines

    for k, name in enumerate("pqr"):
        write_session(cubes({**BUMP, "b": [x + 0.01 * k for x in BUMP["b"]]}), tmp_path / f"{name}.mcap")
    files, told = sorted(tmp_path.glob("*.mcap")), []
    asked = {"detectors": [SLOW, "collider[shape=compound,pieces=2]"] if find_spec("coacd") else [SLOW]}
    alone = audit([*files, files[0]], **asked)
    beside_it = audit([*files, files[0]], jobs=2, on_done=lambda *one: told.append(one), **asked)
    assert sorted(told) == sorted(
        (name, "done") for name in [f"{files[0]} (1)", *map(str, files[1:]), f"{files[0]} (4)"]
    )
    assert beside_it.summary == alone.summary and len(beside_it.results) == 4
    for one, other in zip(alone.results, beside_it.results, strict=True):
        assert headlines(one) == headlines(other) and beside(one) == beside(other)
        assert fault_tables([one]) == fault_tables([other]) and pickle.dumps(other)
        for key in ("digest", "faces_digest"):
            assert [seen[key] for seen in one.summary["detectors"].values()] == [
                seen[key] for seen in other.summary["detectors"].values()
            ]
        assert run_json(other)["misses"] == run_json(one)["misses"] and other.session.origin == one.session.origin


def test_a_folder_in_the_way_of_one_of_several_is_refused_before_any_work(tmp_path):
    for name in ("p", "q"):
        write_session(cubes(BUMP), tmp_path / f"{name}.mcap")
    (tmp_path / "out" / "q").mkdir(parents=True)
    with pytest.raises(OutputError, match="q exists"):
        audit([tmp_path / "p.mcap", tmp_path / "q.mcap"], out=tmp_path / "out", jobs=2)
    assert not (tmp_path / "out" / "p").exists()
