import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from replay.auditing.clock_offset import ClockFacts, estimate_offset
from replay.errors import AuditError

JITTER = 0.008
"""Seconds that a report is early or late at most: less than a frame of 1/90 s."""
BEGINS_OF_AB, ENDS_OF_AB = ("a", "b", "begin"), ("a", "b", "end")
"""Keys of lists of seconds: when contacts of the bodies a and b begin, and end, by the reference or by an engine.

An offset is what is added to a reported time to get a true one."""


@given(st.floats(-1e6, 1e6), st.integers(0, 2**31))
def test_a_shift_is_recovered_despite_lost_and_extra_reports(shift, seed):
    """20 contacts within 60 s are reported ``shift`` seconds too early; a fifth of the reports is lost.

    The others are off by up to JITTER (8 ms), and another report is of no contact.
    """
    rng = np.random.default_rng(seed)
    begins = np.sort(rng.uniform(0, 60, 20))
    truth = {BEGINS_OF_AB: begins.tolist(), ENDS_OF_AB: (begins + rng.uniform(0.1, 1.0, 20)).tolist()}
    reported = {
        key: (np.array(times) - shift + rng.uniform(-JITTER, JITTER, 20))[rng.random(20) < 0.8].tolist()
        for key, times in truth.items()
    }
    report_of_no_contact = -shift + 200.0  # long after all others
    reported[BEGINS_OF_AB] = [*reported[BEGINS_OF_AB], report_of_no_contact]
    result = estimate_offset(reported, truth)
    # The shift may be off by more than the jitter where the window of most reports holds one of another contact.
    assert result.seconds == pytest.approx(shift, abs=1.5 * JITTER)
    # A report is off by its jitter and by what the shift is off: 2.5 * 8 ms, but for those that find another contact.
    assert result.residual < 0.025
    assert result.matched >= result.reports - 4  # that of no contact has no partner; up to three others may have none


def test_the_offset_is_exact_where_the_reports_are():
    """Every report is 10 s after its true moment; the text has the same figures."""
    result = estimate_offset({BEGINS_OF_AB: [10.0, 11.0, 13.5]}, {BEGINS_OF_AB: [0.0, 1.0, 3.5]})
    assert (result.seconds, result.residual, result.matched, result.reports) == (-10.0, 0.0, 3, 3)
    assert str(result) == "clock offset -10.0000 s, residual 0.0 ms of 3 of 3 begins and ends"


def test_of_shifts_that_fit_equally_the_smallest_is_taken():
    """A contact reported from 1 to 1.1 s may be any of three true ones: 1 s earlier, 4 s later, or 0.2 s later.

    The least of these offsets is taken; the text says that two others fit as well.
    """
    reported = {BEGINS_OF_AB: [1.0], ENDS_OF_AB: [1.1]}
    result = estimate_offset(reported, {BEGINS_OF_AB: [0.0, 1.2, 5.0], ENDS_OF_AB: [0.1, 1.3, 5.1]})
    assert result.seconds == pytest.approx(0.2) and result.rivals == 2
    warning = "; 2 other offsets fit as many, the smallest was taken: if it is wrong, give the offset with --"
    assert warning in str(result)


def test_offset_that_fits_more_reports_than_others_has_no_rival():
    """All three reports fit 4 s later; 3 or 5 s later only one begin fits another, so no other offset is as good."""
    reported, truth = {BEGINS_OF_AB: [1.0, 2.0], ENDS_OF_AB: [1.1]}, {BEGINS_OF_AB: [5.0, 6.0], ENDS_OF_AB: [5.1]}
    result = estimate_offset(reported, truth)
    assert result.seconds == pytest.approx(4.0) and result.rivals == 0


def test_given_offset_is_kept_and_its_fit_reported():
    """At the offset 0 that the user gives, one report is 10 ms from a true moment, the other 500 ms.

    Only what is within 50 ms is a partner, and the text says that the other report is left out.
    """
    result = estimate_offset({BEGINS_OF_AB: [1.0, 2.0]}, {BEGINS_OF_AB: [1.01, 2.5]}, known_offset=0.0)
    assert (result.seconds, result.matched) == (0.0, 1)
    assert result.residual == pytest.approx(0.01)
    assert str(result).endswith("; 1 are left out, more than 50 ms from every true one of their pair")


def test_given_offset_without_any_partner_has_no_residual():
    """The user gives an offset of 0.5 s; there is one report, and no true moment at all that it could be of."""
    result = estimate_offset({BEGINS_OF_AB: [1.0]}, {}, known_offset=0.5)
    assert (result.seconds, result.matched, result.residual) == (0.5, 0, None)
    assert str(result).endswith("residual unknown: all 1 begins and ends are over 50 ms from a true one")


def test_offset_of_begins_is_not_guessed_from_ends():
    """A begin is reported and only an end is known: the user is told to give the offset."""
    with pytest.raises(AuditError, match=r"no reported contact is of a pair that truly touches.*--offset"):
        estimate_offset({BEGINS_OF_AB: [1.0]}, {ENDS_OF_AB: [1.0]})


@pytest.mark.parametrize(
    "reported",
    [
        pytest.param({BEGINS_OF_AB: [1.0]}, id="one report"),
        pytest.param({BEGINS_OF_AB: [1.0], ENDS_OF_AB: [9.0]}, id="two that fit no contact"),
    ],
)
def test_single_report_fits_no_clock(reported):
    """Contacts begin at 0 and 3 s, one ends at 4 s. One report fits any of them; of a contact of 8 s there is none."""
    with pytest.raises(AuditError, match=r"fewer than two reports fit true contacts.*--offset"):
        estimate_offset(reported, {BEGINS_OF_AB: [0.0, 3.0], ENDS_OF_AB: [4.0]})


def test_known_offset_needs_no_second_report():
    """The only report is 10 ms from a true begin at the offset 0, and is its partner."""
    assert estimate_offset({BEGINS_OF_AB: [1.0]}, {BEGINS_OF_AB: [0.99]}, known_offset=0.0).matched == 1


def reports_of_a_drifting_clock(contacts, span, drift, rng, jitter=JITTER):
    """Reports of a clock that reads ``drift`` too few seconds a second and 7 s too few, and the truth.

    Contacts begin at random within ``span`` seconds; a tenth of the reports is lost, the others are off by the jitter.
    """
    begins = np.sort(rng.uniform(0, span, contacts))
    truth = {BEGINS_OF_AB: begins, ENDS_OF_AB: begins + rng.uniform(0.1, 1.0, contacts)}
    reported = {
        key: ((moments + rng.uniform(-jitter, jitter, contacts) - 7.0) / (1 + drift))[rng.random(contacts) < 0.9]
        for key, moments in truth.items()
    }
    return {key: item.tolist() for key, item in reported.items()}, {key: item.tolist() for key, item in truth.items()}


@pytest.mark.parametrize(
    ("contacts", "span", "drift"),
    [
        pytest.param(8, 10.0, 0.02, id="8 in 10 s"),
        pytest.param(20, 60.0, -0.02, id="20 in a minute"),
        pytest.param(20, 300.0, 0.001, id="20 in 5 minutes"),
    ],
)
@pytest.mark.parametrize("seed", range(2))
def test_drift_is_detected_reported_and_undone(contacts, span, drift, seed):
    """``contacts`` within ``span`` seconds; the engine's clock loses ``drift`` seconds in each second.

    Reports are off by up to 8 ms (JITTER). The text says the drift that was estimated; with ``at``, the offset at a
    moment, every report is within twice the jitter of a true moment.
    """
    reported, truth = reports_of_a_drifting_clock(contacts, span, drift, np.random.default_rng(seed))
    result = estimate_offset(reported, truth)
    # A line through reports that are off by the jitter was never off by more than that: each is off by twice as much.
    assert result.drift == pytest.approx(drift, abs=2.0 * JITTER / span)
    assert result.residual < 2.0 * JITTER and result.matched == result.reports
    assert f" at the first report, drift {100 * result.drift:+.3f} %, residual" in str(result)
    for key, moments in reported.items():
        placed = [item + result.at(item) for item in moments]
        assert all(min(abs(item - true) for true in truth[key]) < 2.0 * JITTER for item in placed)


@pytest.mark.parametrize(
    ("reported_ends", "drift"), [pytest.param(3, 0.02, id="three contacts"), pytest.param(2, 0.0, id="one end lost")]
)
def test_clock_drift_is_estimated_from_three_contacts_at_least(reported_ends, drift):
    """Reported times are (t - 7) / 1.02: an offset of 7 s and a drift of 2 %, which both ends of 3 contacts show."""
    truth = {BEGINS_OF_AB: [0.0, 5.0, 10.0], ENDS_OF_AB: [0.5, 5.7, 10.9]}
    reported = {key: [(moment - 7.0) / 1.02 for moment in moments] for key, moments in truth.items()}
    reported[ENDS_OF_AB] = reported[ENDS_OF_AB][:reported_ends]
    assert estimate_offset(reported, truth).drift == pytest.approx(drift, abs=1e-9)


def test_steady_clock_is_hardly_ever_given_a_drift():
    """100 random clocks without drift, reports of 2 to 11 contacts off by up to 20 ms: at most one gets a drift."""
    rng, drifts = np.random.default_rng(1), []
    for _ in range(100):
        contacts, span = int(rng.integers(2, 12)), float(rng.uniform(5, 60))
        reported, truth = reports_of_a_drifting_clock(contacts, span, drift=0.0, rng=rng, jitter=0.02)
        drifts.append(estimate_offset(reported, truth).drift)
    assert sum(drift != 0.0 for drift in drifts) <= 1


@pytest.mark.filterwarnings("error")
def test_clock_offset_needs_two_reports_that_fit_contacts():
    """Five contacts of 0.2 s are reported, the only true contact lasts 0.8 s: no offset fits its begin and its end.

    The refusal comes without a warning of a computation with too few numbers.
    """
    begins = [5.0, 6.0, 7.0, 8.0, 9.0]
    reported = {BEGINS_OF_AB: begins, ENDS_OF_AB: [begin + 0.2 for begin in begins]}
    with pytest.raises(AuditError, match="fewer than two reports fit true contacts"):
        estimate_offset(reported, {BEGINS_OF_AB: [1.6], ENDS_OF_AB: [2.4]})


def reported_late(late):
    """The begins and ends of three contacts as an engine reports them, ``late`` seconds late, and the true ones."""
    truth = {BEGINS_OF_AB: [1.0, 3.0, 6.0], ENDS_OF_AB: [1.5, 3.7, 6.9]}
    return {key: [moment + late for moment in moments] for key, moments in truth.items()}, truth


@pytest.mark.parametrize(
    ("late", "is_own_clock"),
    [
        pytest.param(-0.0115, False, id="11.5 ms early"),
        pytest.param(-0.0105, True, id="10.5 ms early"),
        pytest.param(0.0, True, id="in time"),
        pytest.param(0.249, True, id="249 ms late"),
        pytest.param(0.251, False, id="251 ms late"),
    ],
)
def test_recording_clock_explains_reports_by_at_most_the_longest_delay(late, is_own_clock):
    """Frames are 10 ms apart: on the recording's own clock a report may be early by a frame and 1 ms, late by 250 ms.

    Then the offset is 0, and what the reports are late is the delay; else it is all offset of another clock.
    """
    facts = ClockFacts(frame_interval=0.01, recording_clock_offsets=(0.0,))
    result = estimate_offset(*reported_late(late), facts=facts)
    assert result.is_own_clock == is_own_clock
    assert result.seconds == pytest.approx(0.0 if is_own_clock else -late)
    assert result.delay == (pytest.approx(late, abs=1e-9) if is_own_clock else None)


def test_nearest_of_two_recording_clocks_is_taken():
    """The recording may have an offset of 0.1 or of 0 s: reports are 180 ms late on the first clock, 80 on the other.

    Both could explain them; the clock of the shorter delay, the second, is taken.
    """
    facts = ClockFacts(frame_interval=0.01, recording_clock_offsets=(0.1, 0.0))
    assert estimate_offset(*reported_late(0.08), facts=facts).seconds == 0.0


@pytest.mark.parametrize(("physics_step", "delay"), [(0.03, 0.015 - 0.005), (0.005, 0.0)])
def test_reports_of_another_clock_wait_for_a_physics_step(physics_step, delay):
    """The engine's clock is 40 s behind. A report waits half a physics step in the mean, a true moment half a frame.

    Frames are 10 ms apart: with a step of 30 ms, 15 - 5 ms are delay and no offset; a step of 5 ms is no wait at all.
    """
    result = estimate_offset(*reported_late(-40.0), facts=ClockFacts(frame_interval=0.01, physics_step=physics_step))
    assert result.delay == pytest.approx(delay)
    assert result.seconds == pytest.approx(40.0 + delay)


def test_given_offset_is_no_clock_of_the_recording():
    """The reports are in time on the recording's own clock, but the user gives an offset of 1 ms."""
    facts = ClockFacts(frame_interval=0.01, recording_clock_offsets=(0.0,))
    assert not estimate_offset(*reported_late(0.0), known_offset=0.001, facts=facts).is_own_clock


def test_drifting_clock_is_no_clock_of_the_recording():
    """Reports are 78 ms late at first, which a delay could explain, and then ever earlier by 2 %, which none does."""
    reported, truth = reported_late(0.1)
    drifting = {key: [moment / 1.02 for moment in moments] for key, moments in reported.items()}  # 1.1 / 1.02 = 1.078
    facts = ClockFacts(frame_interval=0.01, recording_clock_offsets=(0.0,))
    result = estimate_offset(drifting, truth, facts=facts)
    assert result.drift == pytest.approx(0.02) and not result.is_own_clock
