import pytest
from support.small_worlds import cubes

from replay.contact_import import DRIFT_FACT, OFFSET_FACT, import_contacts
from replay.errors import AuditError
from replay.pipeline.engine import compute
from replay.prepare.assemble import RESIDUAL_FACT
from sessions import read_session, write_session

PLACES = {"a": [0] * 14, "b": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3, 3, 3]}
CSV = "time,a,b,what\n100.04,a,b,begin\n100.04,a,b,end\n100.08,b,a,begin\n100.10,b,a,end\n100.2,a,Floor,begin\n"


@pytest.fixture
def csv(tmp_path):
    path = tmp_path / "engine.csv"
    path.write_text(CSV, encoding="utf-8")
    return path


def test_another_clock_is_fitted_and_the_reports_become_a_detector(csv, tmp_path):
    session, fit = import_contacts(csv, cubes(PLACES))
    assert fit.seconds == pytest.approx(-100.0) and fit.residual == pytest.approx(0.0, abs=1e-9)
    assert (fit.matched, fit.of) == (4, 5)
    assert float(session.facts[OFFSET_FACT]) == pytest.approx(-100.0)
    assert float(session.facts[DRIFT_FACT]) == 0.0
    write_session(session, tmp_path / "s.mcap")
    result = compute(read_session(tmp_path / "s.mcap"), detectors="recorded", oracle="exact")
    assert result.summary["audit"]["recorded"]["missed"]["count"] == 0
    assert result.summary["audit"]["recorded"]["missed"]["of"] == 4


def test_a_given_offset_is_taken_as_it_is(csv):
    session, fit = import_contacts(csv, cubes(PLACES), offset=-99.99)
    assert fit.seconds == -99.99 and fit.residual == pytest.approx(0.01)
    assert float(session.facts[RESIDUAL_FACT]) == pytest.approx(0.01)
    assert session.live_contacts[0].time_ns == 50_000_000


def test_what_began_before_the_session_or_outlasts_it_has_no_begin_or_end_to_fit(tmp_path):
    (tmp_path / "x.csv").write_text("0,a,b,begin\n0.1,a,b,end\n0.3,a,b,begin\n0.4,a,b,end\n")
    world = cubes({"a": [0] * 5, "b": [0.9, 0.9, 1.4, 0.9, 0.9]}, step_ns=100_000_000, first_ns=5_000_000_000)
    session, fit = import_contacts(tmp_path / "x.csv", world, offset=0.0)
    assert (fit.matched, fit.residual) == (2, pytest.approx(0.0, abs=1e-9))
    assert session.live_contacts[1].time_ns == 5_100_000_000


def test_without_a_partner_the_residual_is_unknown(csv):
    session, fit = import_contacts(csv, cubes(PLACES), offset=50.0)
    assert (fit.residual, session.facts[RESIDUAL_FACT]) == (None, "unknown")


def test_a_file_about_other_bodies_is_refused(tmp_path):
    (tmp_path / "x.csv").write_text("0,x,y,begin\n")
    with pytest.raises(AuditError, match="names no body of the session, which has: a, b"):
        import_contacts(tmp_path / "x.csv", cubes(PLACES))
