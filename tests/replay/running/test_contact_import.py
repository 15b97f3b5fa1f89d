from dataclasses import replace
from types import SimpleNamespace
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

X_OF_CUBES = {"a": [0] * 14, "b": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3, 3, 3]}
"""Metres on X of two cubes of 1 m, frame by frame of 10 ms: in contact in frame 4 and in frames 8 to 10.

The contacts go from 0.04 to 0.05 s and from 0.08 to 0.11 s.
"""

CSV_OF_REPORTS = (
    "time,a,b,what\n100.04,a,b,begin\n100.05,a,b,end\n100.08,b,a,begin\n100.11,b,a,end\n100.2,a,Floor,begin\n"
)


@pytest.fixture
def log_100_s_ahead(tmp_path):
    """An engine's log of both contacts, whose clock is 100 s ahead; a fifth report is of Floor, which is no body."""
    path = tmp_path / "engine.csv"
    path.write_text(CSV_OF_REPORTS, encoding="utf-8")
    return path


def test_offset_of_another_clock_is_fitted(log_100_s_ahead):
    """Four reports are exactly 100 s ahead of the contacts; the fifth, of Floor, has none to match.

    The session keeps the offset and the drift, 0, as facts.
    """
    session, fit = import_contacts(log_100_s_ahead, unit_cubes_on_x(X_OF_CUBES))
    assert fit.seconds == pytest.approx(-100.0)
    assert fit.residual == pytest.approx(0.0, abs=1e-9)
    assert (fit.matched, fit.reports) == (4, 5)
    assert float(session.facts[OFFSET_FACT]) == pytest.approx(-100.0)
    assert float(session.facts[DRIFT_FACT]) == 0.0


def test_imported_reports_are_a_detector_that_misses_nothing(log_100_s_ahead, tmp_path):
    """Reports are compared with exact after a round trip through a file: it finds contact in 1 + 3 frames."""
    session, _fit = import_contacts(log_100_s_ahead, unit_cubes_on_x(X_OF_CUBES))
    write_session(session, tmp_path / "s.mcap")
    result = compute(read_session(tmp_path / "s.mcap"), detectors="recorded", oracle="exact")
    missed = result.document.audit["recorded"].time_missed
    assert (missed.count, missed.of) == (0, 1 + 3)


def test_stated_clock_offset_is_used_without_fitting(log_100_s_ahead):
    """The log's clock is 100 s ahead; -99.99 s leaves every report 10 ms late: the first, of 40 ms, is at 50 ms."""
    session, fit = import_contacts(log_100_s_ahead, unit_cubes_on_x(X_OF_CUBES), offset=-99.99)
    assert fit.seconds == -99.99
    assert fit.residual == pytest.approx(0.01)
    assert float(session.facts[RESIDUAL_FACT]) == pytest.approx(0.01)
    assert session.live_contacts[0].time_ns == 50_000_000


def test_contacts_beyond_session_bounds_fit_no_begin_or_end(tmp_path):
    """Five frames of 100 ms from stamp 5 s on; contact in all but the third, from 0.2 to 0.3 s.

    Contact in the first and last frame has no begin or end there: two of four reports fit. Reports count from the
    first frame: 0.2 s is stamp 5.2 s.
    """
    (tmp_path / "x.csv").write_text("0,a,b,begin\n0.2,a,b,end\n0.3,a,b,begin\n0.5,a,b,end\n")
    recorded = unit_cubes_on_x(
        {"a": [0] * 5, "b": [0.9, 0.9, 1.4, 0.9, 0.9]}, step_ns=100_000_000, first_ns=5_000_000_000
    )
    session, fit = import_contacts(tmp_path / "x.csv", recorded, offset=0.0)
    assert (fit.matched, fit.residual) == (2, pytest.approx(0.0, abs=1e-9))
    assert session.live_contacts[1].time_ns == 5_200_000_000


def test_without_a_partner_the_residual_is_unknown(tmp_path):
    """Five frames of 100 ms, with contact in the second, from 0.1 to 0.2 s; the reports are of 0.3 s."""
    (tmp_path / "x.csv").write_text("0.3,a,b,begin\n0.31,a,b,end\n")
    recorded = unit_cubes_on_x({"a": [0] * 5, "b": [3, 0.9, 3, 3, 3]}, step_ns=100_000_000)
    session, fit = import_contacts(tmp_path / "x.csv", recorded, offset=0.0)
    assert (fit.residual, session.facts[RESIDUAL_FACT]) == (None, "unknown")


@pytest.mark.parametrize(
    ("rows", "offset", "message"),
    [
        pytest.param(
            "100.04,a,b,begin\n100.05,a,b,end",
            0.0,
            "2 reports, the first 99.9 s after the last frame; check the offset",
            id="100.04 s is 99.9 s after 0.13 s",
        ),
        pytest.param(
            "100.04,a,b,begin\n100.05,a,b,end",
            -101.0,
            "2 reports, the first 960 ms before the first frame",
            id="100.04 s less 101 s is -960 ms",
        ),
        pytest.param(
            "100.04,a,b,begin\n101.05,a,b,end",
            -101.0,
            "2 reports, the first 960 ms before the first frame",
            id="one of two reports is before the first frame",
        ),
        pytest.param(
            "40,a,b,begin\n50,a,b,end\n80,a,b,begin",
            None,
            "the reports last 40 s, the session 130 ms: write seconds",
            id="300 times as long as the session",
        ),
        pytest.param(
            "0.04,a,bb,begin\n0.05,a,bb,end",
            None,
            "of two bodies of the session: there is no 'bb'; did you mean 'b'",
            id="body that the session has not",
        ),
    ],
)
def test_reports_that_cannot_be_the_sessions_are_refused(tmp_path, rows, offset, message):
    """The session lasts from 0 to 0.13 s; ``offset``: seconds added to each report, None: to be estimated."""
    (tmp_path / "x.csv").write_text(rows)
    with pytest.raises(AuditError, match=message):
        import_contacts(tmp_path / "x.csv", unit_cubes_on_x(X_OF_CUBES), offset=offset)


@pytest.mark.parametrize(
    ("rows", "offset", "message"),
    [
        pytest.param(
            "100.0,a,b,begin\n100.1,a,b,end",
            -103.0,
            "2 reports, the first 3 s before the first frame",
            id="100 s less 103 s is 3 s before the first frame, stamp 2 s",
        ),
        pytest.param(
            "40,a,b,begin\n50,a,b,end\n80,a,b,begin",
            None,
            "the reports last 40 s, the session 130 ms: write seconds",
            id="40 s of reports, likely not in seconds",
        ),
    ],
)
def test_reports_that_fit_no_recording_from_5_s_are_refused(tmp_path, rows, offset, message):
    """The session has 14 frames of 10 ms from stamp 5 s on; ``offset`` is added to a report, 0 is the first frame.

    A report 3 s before that has a stamp that is not negative, and could stand in a file.
    """
    (tmp_path / "x.csv").write_text(rows)
    session = unit_cubes_on_x(X_OF_CUBES, first_ns=5_000_000_000)
    with pytest.raises(AuditError, match=message):
        import_contacts(tmp_path / "x.csv", session, offset=offset)


def test_a_file_about_other_bodies_is_refused(tmp_path):
    """The only report is of x and y; the session has a and b."""
    (tmp_path / "x.csv").write_text("0,x,y,begin\n")
    with pytest.raises(AuditError, match="names no body of the session, which has: a, b"):
        import_contacts(tmp_path / "x.csv", unit_cubes_on_x(X_OF_CUBES))


TAPS = 8
"""Contacts of a session."""

FRAME_HZ = 90.0


def stamps_begins_and_ends(seed):
    """Stamps of a jittered clock of about 90 Hz from 3.2 s on, and begins and ends of 8 taps in between, in seconds.

    A tap lasts 0.06 to 0.3 s; the next begins 0.45 to 0.75 s after it began.
    """
    rng = np.random.default_rng(seed)
    stamps = 3.2 + np.cumsum(rng.uniform(0.009, 0.0132, int(TAPS * 0.7 * FRAME_HZ)))
    begins = 3.2 + np.cumsum(rng.uniform(0.45, 0.75, TAPS))
    return stamps, begins, begins + rng.uniform(0.06, 0.3, TAPS)


def engine_reports(begins, ends, *, hertz, delay=0.0):
    """Reports, (seconds, enter or exit), of an engine that samples at its steps, and writes them ``delay`` s later.

    A contact enters in the first step within it, and exits in the first step after it.
    """
    rows = []
    for begin, end in zip(begins, ends, strict=True):
        first, after = np.ceil(begin * hertz) / hertz, np.ceil(end * hertz) / hertz
        if first < after:
            rows += [(first + delay, "enter"), (after + delay, "exit")]
    return rows


def unity_log(path, *, stamps, begins, ends, reports):
    """The session in a log of the Unity script: two cubes of 1 m, 0.9 m apart during a tap and 1.3 m between taps."""
    is_touching = ((stamps[:, None] >= begins) & (stamps[:, None] < ends)).any(axis=1)
    lines = ["time,kind,body,px,py,pz,qx,qy,qz,qw,tracked,other,value"]
    for moment, x in zip(stamps.tolist(), np.where(is_touching, 0.9, 1.3).tolist(), strict=True):
        lines += [f"{moment:.6f},pose,a,0,0,0,0,0,0,1,1,,", f"{moment:.6f},pose,b,{x},0,0,0,0,0,1,1,,"]
    lines += [f"{moment:.6f},{phase},a,,,,,,,,,b," for moment, phase in reports]
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
    """The engine reports each begin and end of 8 taps in the first frame at or after it, as exact sees them."""
    stamps, begins, ends = stamps_begins_and_ends(seed)
    moments = sorted([(moment, "enter") for moment in begins] + [(moment, "exit") for moment in ends])
    reports = [(stamps[np.searchsorted(stamps, moment)], phase) for moment, phase in moments]
    session = unity_log(tmp_path / "log.csv", stamps=stamps, begins=begins, ends=ends, reports=reports)
    assert recorded_counts(session) == ContactCounts(TAPS, missed=0, late_or_cut_short=0, false_frames=0)


HOUR = 3600.0
"""Seconds by which another clock is ahead."""


@pytest.fixture(scope="module", params=[0.0, 0.04], ids=["no delay", "40 ms delay"])
def engine_of_50_hz(request, tmp_path_factory):
    """Reports of an engine of 50 Hz, that come so many seconds after its step, and a session that has them.

    The session has frames of about 90 Hz from about 3.2 s on; ``import_later`` imports the reports again, from a file
    in which times are ``shift`` seconds smaller, into the session without them.
    """
    folder = tmp_path_factory.mktemp("engine")
    stamps, begins, ends = stamps_begins_and_ends(seed=7)
    reports = engine_reports(begins, ends, hertz=50.0, delay=request.param)
    session = unity_log(folder / "log.csv", stamps=stamps, begins=begins, ends=ends, reports=reports)

    def import_later(shift):
        rows = [f"{moment - shift:.6f},a,b,{'begin' if phase == 'enter' else 'end'}" for moment, phase in reports]
        (folder / "engine.csv").write_text("\n".join(rows), encoding="utf-8")
        return import_contacts(folder / "engine.csv", replace(session, live_contacts=()))

    return SimpleNamespace(
        delay=request.param, first_stamp=stamps[0], counts=recorded_counts(session), import_later=import_later
    )


def test_engine_of_50_hz_is_late_for_most_taps(engine_of_50_hz):
    """Steps are 20 ms apart, frames 11 ms: the first step after a begin is mostly later than the first frame after it.

    The first step after an end is mostly later, too: contact that is reported until then is false.
    """
    assert engine_of_50_hz.counts.late_or_cut_short > TAPS // 2
    assert engine_of_50_hz.counts.false_frames > 0


@pytest.mark.parametrize("counts_from_first_frame", [False, True])
def test_engine_has_the_same_faults_imported_on_the_recordings_clock(engine_of_50_hz, counts_from_first_frame):
    """The file has the recording's stamps, or seconds from its first frame; the delay of the engine is estimated.

    A step of 20 ms is 10 ms after a begin on average, the frame that first shows it half of 11 ms: to 3 ms.
    """
    shift = engine_of_50_hz.first_stamp if counts_from_first_frame else 0.0
    imported, fit = engine_of_50_hz.import_later(shift)
    assert fit.is_own_clock
    assert fit.delay == pytest.approx(engine_of_50_hz.delay + 0.010 - 0.0055, abs=0.003)
    assert recorded_counts(imported) == engine_of_50_hz.counts


def test_offset_of_a_clock_an_hour_ahead_is_fitted(engine_of_50_hz):
    """``seconds``: added to a reported time, give seconds since the first frame; fitted to 4 ms.

    A delay by another clock cannot be distinguished from the offset, so that reports lose it. Without a delay up to
    two contacts more or less begin a frame late.
    """
    imported, fit = engine_of_50_hz.import_later(shift=-HOUR)
    assert not fit.is_own_clock
    assert fit.seconds == pytest.approx(-HOUR - engine_of_50_hz.first_stamp - engine_of_50_hz.delay, abs=0.004)
    if engine_of_50_hz.delay == 0.0:
        counts, few = recorded_counts(imported), 2
        for name in ("contacts", "missed", "late_or_cut_short"):
            assert abs(getattr(counts, name) - getattr(engine_of_50_hz.counts, name)) <= few, name
