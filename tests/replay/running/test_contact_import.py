from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from support.small_worlds import cube, unit_cubes_on_x

from replay.detection.recorded import DRIFT_FACT, OFFSET_FACT
from replay.engine import compute
from replay.errors import AuditError
from replay.prepare.assemble import RESIDUAL_FACT
from replay.running.contact_import import import_contacts
from sessions import import_session, read_session, write_session

POSITIONS = {"a": [0] * 14, "b": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3, 3, 3]}
"""Metres on X of two unit cubes: in contact in frame 4 and in frames 8 to 10, of 10 ms."""

CSV_OF_REPORTS = (
    "time,a,b,what\n100.04,a,b,begin\n100.05,a,b,end\n100.08,b,a,begin\n100.11,b,a,end\n100.2,a,Floor,begin\n"
)


@pytest.fixture
def log_100_s_ahead(tmp_path):
    """An engine's log whose clock is 100 s ahead; its fifth report is of Floor, which is no body of the session."""
    path = tmp_path / "engine.csv"
    path.write_text(CSV_OF_REPORTS, encoding="utf-8")
    return path


def test_offset_of_another_clock_is_fitted(log_100_s_ahead):
    """Four reports are exactly 100 s ahead of the contacts; the fifth, of Floor, has none to match."""
    session, fit = import_contacts(log_100_s_ahead, unit_cubes_on_x(POSITIONS))
    assert fit.seconds == pytest.approx(-100.0) and fit.residual == pytest.approx(0.0, abs=1e-9)
    assert (fit.matched, fit.reports) == (4, 5)
    assert float(session.facts[OFFSET_FACT]) == pytest.approx(-100.0)
    assert float(session.facts[DRIFT_FACT]) == 0.0


def test_imported_reports_are_a_detector_that_misses_nothing(log_100_s_ahead, tmp_path):
    """Reports are compared after a round trip through a file; unit cubes below 1 m are in contact, 4 frames."""
    session, _ = import_contacts(log_100_s_ahead, unit_cubes_on_x(POSITIONS))
    write_session(session, tmp_path / "s.mcap")
    result = compute(read_session(tmp_path / "s.mcap"), detectors="recorded", oracle="exact")
    missed = result.document.audit["recorded"].time_missed
    assert missed.count == 0
    assert missed.of == sum(x < 1 for x in POSITIONS["b"]) == 4


def test_stated_clock_offset_is_used_without_fitting(log_100_s_ahead):
    """The log's clock is 100 s ahead; -99.99 s leaves every report 10 ms late."""
    session, fit = import_contacts(log_100_s_ahead, unit_cubes_on_x(POSITIONS), offset=-99.99)
    assert fit.seconds == -99.99 and fit.residual == pytest.approx(0.01)
    assert float(session.facts[RESIDUAL_FACT]) == pytest.approx(0.01)
    assert session.live_contacts[0].time_ns == 50_000_000


def test_contacts_beyond_session_bounds_fit_no_begin_or_end(tmp_path):
    """Contact in the first and last frame has no begin or end there: two of four reports fit."""
    (tmp_path / "x.csv").write_text("0,a,b,begin\n0.2,a,b,end\n0.3,a,b,begin\n0.5,a,b,end\n")
    world = unit_cubes_on_x({"a": [0] * 5, "b": [0.9, 0.9, 1.4, 0.9, 0.9]}, step_ns=100_000_000, first_ns=5_000_000_000)
    session, fit = import_contacts(tmp_path / "x.csv", world, offset=0.0)
    assert (fit.matched, fit.residual) == (2, pytest.approx(0.0, abs=1e-9))
    assert session.live_contacts[1].time_ns == 5_200_000_000


def test_without_a_partner_the_residual_is_unknown(tmp_path):
    """Frames are 100 ms apart: contact is in 0.1 s, and the reports are of 0.3 s."""
    (tmp_path / "x.csv").write_text("0.3,a,b,begin\n0.31,a,b,end\n")
    world = unit_cubes_on_x({"a": [0] * 5, "b": [3, 0.9, 3, 3, 3]}, step_ns=100_000_000)
    session, fit = import_contacts(tmp_path / "x.csv", world, offset=0.0)
    assert (fit.residual, session.facts[RESIDUAL_FACT]) == (None, "unknown")


@pytest.mark.parametrize(
    ("rows", "offset", "message"),
    [
        ("100.04,a,b,begin\n100.05,a,b,end", 0.0, "2 reports, the first 99.9 s after the last frame; check the offset"),
        ("100.04,a,b,begin\n100.05,a,b,end", -101.0, "2 reports, the first 960 ms before the first frame"),
        ("100.04,a,b,begin\n101.05,a,b,end", -101.0, "2 reports, the first 960 ms before the first frame"),
        (
            "40,a,b,begin\n50,a,b,end\n80,a,b,begin",
            None,
            "the reports last 40 s, the session 130 ms: write seconds",
        ),
        ("0.04,a,bb,begin\n0.05,a,bb,end", None, "of two bodies of the session: there is no 'bb'; did you mean 'b'"),
    ],
)
def test_reports_that_cannot_be_the_sessions_are_refused(tmp_path, rows, offset, message):
    """The session lasts from 0 to 0.13 s. Shifted by ``offset`` all reports are after or before it, or begin before it.

    Without an offset they last 300 times as long as the session, or name a body that it has not.
    """
    (tmp_path / "x.csv").write_text(rows)
    with pytest.raises(AuditError, match=message):
        import_contacts(tmp_path / "x.csv", unit_cubes_on_x(POSITIONS), offset=offset)


@pytest.mark.parametrize(
    ("rows", "offset", "message"),
    [
        ("100.0,a,b,begin\n100.1,a,b,end", -103.0, "2 reports, the first 3 s before the first frame"),
        ("40,a,b,begin\n50,a,b,end\n80,a,b,begin", None, "the reports last 40 s, the session 130 ms: write seconds"),
    ],
)
def test_reports_outside_a_recording_from_5_s_are_refused(tmp_path, rows, offset, message):
    """The first ones end 3 s before its first frame, with stamps that a file can hold."""
    (tmp_path / "x.csv").write_text(rows)
    session = unit_cubes_on_x(POSITIONS, first_ns=5_000_000_000)
    with pytest.raises(AuditError, match=message):
        import_contacts(tmp_path / "x.csv", session, offset=offset)


def test_a_file_about_other_bodies_is_refused(tmp_path):
    """The only report is of x and y; the session has a and b."""
    (tmp_path / "x.csv").write_text("0,x,y,begin\n")
    with pytest.raises(AuditError, match="names no body of the session, which has: a, b"):
        import_contacts(tmp_path / "x.csv", unit_cubes_on_x(POSITIONS))


TAPS = 15
"""Contacts of a session."""

FRAME_HZ = 90.0


def stamps_begins_and_ends(seed):
    """Stamps of a jittered clock in seconds, and begins and ends of contacts in between."""
    rng = np.random.default_rng(seed)
    stamps = 3.2 + np.cumsum(rng.uniform(0.009, 0.0132, int(TAPS * 0.7 * FRAME_HZ)))
    begins = 3.2 + np.cumsum(rng.uniform(0.45, 0.75, TAPS))
    return stamps, begins, begins + rng.uniform(0.06, 0.3, TAPS)


def engine_reports(begins, ends, *, hertz, delay=0.0):
    """Seconds, and enter or exit, as an engine reports that looks at its steps: exit in the first step without it."""
    rows = []
    for begin, end in zip(begins, ends, strict=True):
        first, after = np.ceil(begin * hertz) / hertz, np.ceil(end * hertz) / hertz
        if first < after:
            rows += [(first + delay, "enter"), (after + delay, "exit")]
    return rows


def unity_log(path, stamps, begins, ends, reports):
    """The log of the Unity script: two cubes, b goes away from a between contacts."""
    touching = ((stamps[:, None] >= begins) & (stamps[:, None] < ends)).any(axis=1)
    lines = ["time,kind,body,px,py,pz,qx,qy,qz,qw,tracked,other,value"]
    for moment, x in zip(stamps.tolist(), np.where(touching, 0.9, 1.3).tolist(), strict=True):
        lines += [f"{moment:.6f},pose,a,0,0,0,0,0,0,1,1,,", f"{moment:.6f},pose,b,{x},0,0,0,0,0,1,1,,"]
    lines += [f"{moment:.6f},{what},a,,,,,,,,,b," for moment, what in reports]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return replace(import_session("csv", path), meshes={"a": cube(), "b": cube()})


class ContactCounts(NamedTuple):
    """Contacts by exact, and what the recorded reports make of them."""

    contacts: int
    missed: int
    late_or_cut_short: int
    false_frames: int


def recorded_counts(session):
    """Counts of the engine's recorded reports beside exact."""
    audit = compute(session, detectors="recorded", oracle="exact").document.audit["recorded"]
    return ContactCounts(audit.contacts, audit.contacts_missed, audit.late_or_cut_short, audit.false_contact.count)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_a_perfect_engine_in_a_unity_log_is_wrong_nowhere(tmp_path, seed):
    """The engine reports each tap in the first frame in or after which it begins or ends."""
    stamps, begins, ends = stamps_begins_and_ends(seed)
    frames = [
        (stamps[np.searchsorted(stamps, moment)], what)
        for moment, what in sorted([(moment, "enter") for moment in begins] + [(moment, "exit") for moment in ends])
    ]
    session = unity_log(tmp_path / "log.csv", stamps=stamps, begins=begins, ends=ends, reports=frames)
    assert recorded_counts(session) == ContactCounts(TAPS, missed=0, late_or_cut_short=0, false_frames=0)


@pytest.mark.parametrize(
    ("clock", "delay"),
    [
        ("the recording's", 0.0),
        ("from its first frame", 0.04),
        pytest.param("another", 0.0, marks=pytest.mark.slow),
        ("another", 0.04),
    ],
)
def test_an_engine_has_the_same_faults_by_every_import(tmp_path, clock, delay):
    """``clock``: what the stamps of the CSV count from; ``delay``: seconds from an engine's step to its report."""
    stamps, begins, ends = stamps_begins_and_ends(seed=7)
    reports = engine_reports(begins, ends, hertz=50.0, delay=delay)
    session = unity_log(tmp_path / "log.csv", stamps=stamps, begins=begins, ends=ends, reports=reports)
    unity = recorded_counts(session)
    assert unity.late_or_cut_short > TAPS // 2 and unity.false_frames > 0
    shift = {"the recording's": 0.0, "from its first frame": stamps[0], "another": -3600.0}[clock]
    rows = [f"{moment - shift:.6f},a,b,{'begin' if what == 'enter' else 'end'}" for moment, what in reports]
    (tmp_path / "engine.csv").write_text("\n".join(rows), encoding="utf-8")
    imported, fit = import_contacts(tmp_path / "engine.csv", replace(session, live_contacts=()))
    if clock != "another":
        # A step of 20 ms is 10 ms after a begin on average, the frame that first shows it half of 11 ms.
        assert fit.is_own_clock and fit.delay == pytest.approx(delay + 0.010 - 0.0055, abs=0.003)
        assert recorded_counts(imported) == unity
    elif not delay:
        # Fitted within a few milliseconds, so a few contacts more or less begin a frame late.
        assert not fit.is_own_clock and fit.seconds == pytest.approx(-3600.0 - stamps[0], abs=0.004)
        imported_counts = recorded_counts(imported)
        for count in ("contacts", "missed", "late_or_cut_short"):
            assert abs(getattr(imported_counts, count) - getattr(unity, count)) <= 3, count
    else:
        # Of another clock a delay cannot be distinguished from the offset.
        assert fit.seconds == pytest.approx(-3600.0 - stamps[0] - delay, abs=0.004)
