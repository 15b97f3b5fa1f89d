import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from replay.auditing.clock_offset import ClockFacts, estimate_offset
from replay.errors import AuditError

JITTER = 0.008
"""Seconds that a report is early or late at most: less than a frame of 1/90 s."""
BEGINS_OF_AB, ENDS_OF_AB = ("a", "b", "begin"), ("a", "b", "end")
"""Keys of moments in seconds: reports of a pair's begins are compared with the true begins of that pair alone."""


@settings(max_examples=40)
@given(st.floats(-1e6, 1e6), st.integers(0, 2**31))
def test_a_shift_is_recovered_despite_lost_and_extra_reports(shift, seed):
    """A fifth of the reports is lost, the others are off by a jitter, and one is of no contact."""
    rng = np.random.default_rng(seed)
    begins = np.sort(rng.uniform(0, 60, 20))
    truth = {BEGINS_OF_AB: begins.tolist(), ENDS_OF_AB: (begins + rng.uniform(0.1, 1.0, 20)).tolist()}
    reported = {
        key: (np.array(times) - shift + rng.uniform(-JITTER, JITTER, 20))[rng.random(20) < 0.8].tolist()
        for key, times in truth.items()
    }
    # One report of a contact that was none, long after all others.
    reported[BEGINS_OF_AB] = [*reported[BEGINS_OF_AB], -shift + 200.0]
    result = estimate_offset(reported, truth)
    # The shift may be off by more than the jitter where the window of most reports holds one of another contact.
    assert result.seconds == pytest.approx(shift, abs=1.5 * JITTER)
    # A report is off by its jitter and by what the shift is off: 20 ms, but for those that find another contact.
    assert result.residual < 0.025 and result.matched >= result.reports - 4


def test_the_offset_is_exact_where_the_reports_are():
    """Every report is 10 s after its true moment."""
    result = estimate_offset({BEGINS_OF_AB: [10.0, 11.0, 13.5]}, {BEGINS_OF_AB: [0.0, 1.0, 3.5]})
    assert (result.seconds, result.residual, result.matched, result.reports) == (-10.0, 0.0, 3, 3)
    assert str(result) == "clock offset -10.0000 s, residual 0.0 ms of 3 of 3 begins and ends"


def test_of_shifts_that_fit_equally_the_smallest_is_taken():
    """One contact from 1 to 1.1 s is any of three true ones: 1 s earlier, 4 s later, or 0.2 s later, the least."""
    begins, ends = [0.0, 1.2, 5.0], [0.1, 1.3, 5.1]
    result = estimate_offset({BEGINS_OF_AB: [1.0], ENDS_OF_AB: [1.1]}, {BEGINS_OF_AB: begins, ENDS_OF_AB: ends})
    assert result.seconds == pytest.approx(0.2) and result.rivals == 2
    warning = "; 2 other offsets fit as many, the smallest was taken: if it is wrong, give the offset with --"
    assert warning in str(result)


def test_offset_that_fits_more_reports_than_others_has_no_rival():
    """All three reports fit 4 s later; 3 or 5 s later, only one begin fits another."""
    reported, truth = {BEGINS_OF_AB: [1.0, 2.0], ENDS_OF_AB: [1.1]}, {BEGINS_OF_AB: [5.0, 6.0], ENDS_OF_AB: [5.1]}
    assert estimate_offset(reported, truth).rivals == 0


def test_given_offset_is_kept_and_its_fit_reported():
    """At offset 0 the first report is 10 ms from a true moment, the second 500 ms, which is no partner."""
    result = estimate_offset({BEGINS_OF_AB: [1.0, 2.0]}, {BEGINS_OF_AB: [1.01, 2.5]}, known_offset=0.0)
    assert (result.seconds, result.matched) == (0.0, 1) and result.residual == pytest.approx(0.01)
    assert str(result).endswith("; 1 are left out, more than 50 ms from every true one of their pair")
    lost = estimate_offset({BEGINS_OF_AB: [1.0]}, {}, known_offset=0.5)
    assert (lost.matched, lost.residual) == (0, None)
    assert str(lost).endswith("residual unknown: all 1 begins and ends are over 50 ms from a true one")


def test_offset_of_begins_is_not_guessed_from_ends():
    """A begin is reported and only an end is known: the user is told to give the offset."""
    with pytest.raises(AuditError, match="--offset"):
        estimate_offset({BEGINS_OF_AB: [1.0]}, {ENDS_OF_AB: [1.0]})


@pytest.mark.parametrize("reported", [{BEGINS_OF_AB: [1.0]}, {BEGINS_OF_AB: [1.0], ENDS_OF_AB: [9.0]}])
def test_single_report_fits_no_clock(reported):
    """Two reports of different phases of one contact are too few as well; a known offset needs none."""
    with pytest.raises(AuditError, match=r"fewer than two reports fit true contacts.*--offset"):
        estimate_offset(reported, {BEGINS_OF_AB: [0.0, 3.0], ENDS_OF_AB: [4.0]})
    assert estimate_offset(reported, {BEGINS_OF_AB: [0.99]}, known_offset=0.0).matched == 1


def reports_of_a_drifting_clock(contacts, span, drift, rng, jitter=JITTER):
    """Reports of a clock that reads ``drift`` too few seconds a second and 7 s too few, and the truth."""
    begins = np.sort(rng.uniform(0, span, contacts))
    truth = {BEGINS_OF_AB: begins, ENDS_OF_AB: begins + rng.uniform(0.1, 1.0, contacts)}
    reported = {
        key: ((moments + rng.uniform(-jitter, jitter, contacts) - 7.0) / (1 + drift))[rng.random(contacts) < 0.9]
        for key, moments in truth.items()
    }
    return {key: item.tolist() for key, item in reported.items()}, {key: item.tolist() for key, item in truth.items()}


@pytest.mark.parametrize(("contacts", "span", "drift"), [(8, 10.0, 0.02), (20, 60.0, -0.02), (20, 300.0, 0.001)])
@pytest.mark.parametrize("seed", range(4))
def test_drift_is_detected_reported_and_undone(contacts, span, drift, seed):
    """``span``: seconds of the recording; ``drift``: seconds that the clock of the reports loses in each second."""
    reported, truth = reports_of_a_drifting_clock(contacts, span, drift, np.random.default_rng(seed))
    result = estimate_offset(reported, truth)
    # A line through reports that are off by the jitter was never off by more than that: each is off by twice as much.
    assert result.drift == pytest.approx(drift, abs=2.0 * JITTER / span)
    assert result.residual < 2.0 * JITTER and result.matched == result.reports
    assert f" at the first report, drift {100 * result.drift:+.3f} %, residual" in str(result)
    for key, moments in reported.items():
        placed = [item + result.at(item) for item in moments]
        assert all(min(abs(item - true) for true in truth[key]) < 2.0 * JITTER for item in placed)


@pytest.mark.parametrize(("ends", "drift"), [(3, 0.02), (2, 0.0)])
def test_clock_drift_is_estimated_from_three_contacts_at_least(ends, drift):
    """Reported times are (t - 7) / 1.02: an offset of 7 s and a drift of 2 %."""
    truth = {BEGINS_OF_AB: [0.0, 5.0, 10.0], ENDS_OF_AB: [0.5, 5.7, 10.9]}
    reported = {key: [(moment - 7.0) / 1.02 for moment in moments] for key, moments in truth.items()}
    assert estimate_offset({**reported, ENDS_OF_AB: reported[ENDS_OF_AB][:ends]}, truth).drift == pytest.approx(
        drift, abs=1e-9
    )


def test_steady_clock_is_hardly_ever_given_a_drift():
    """At most one of 100 random clocks without drift may get one by chance."""
    rng, drifts = np.random.default_rng(1), []
    for _ in range(100):
        contacts, span = int(rng.integers(2, 12)), float(rng.uniform(5, 60))
        reported, truth = reports_of_a_drifting_clock(contacts, span, drift=0.0, rng=rng, jitter=0.02)
        drifts.append(estimate_offset(reported, truth).drift)
    assert sum(drift != 0.0 for drift in drifts) <= 1


@pytest.mark.filterwarnings("error")
def test_clock_offset_needs_two_reports_that_fit_contacts():
    """Reports last 0.2 s, the only true contact 0.8 s: no offset fits both its begin and its end."""
    begins = [5.0 + k for k in range(5)]
    reported = {BEGINS_OF_AB: begins, ENDS_OF_AB: [begin + 0.2 for begin in begins]}
    with pytest.raises(AuditError, match="fewer than two reports fit true contacts"):
        estimate_offset(reported, {BEGINS_OF_AB: [1.6], ENDS_OF_AB: [2.4]})


def reported_late(late):
    """The true begins and ends of three contacts, reported so many seconds late, and the truth."""
    truth = {BEGINS_OF_AB: [1.0, 3.0, 6.0], ENDS_OF_AB: [1.5, 3.7, 6.9]}
    return {key: [moment + late for moment in moments] for key, moments in truth.items()}, truth


@pytest.mark.parametrize(
    ("late", "is_own_clock"), [(-0.0115, False), (-0.0105, True), (0.0, True), (0.249, True), (0.251, False)]
)
def test_recording_clock_explains_reports_by_at_most_the_longest_delay(late, is_own_clock):
    """Frames are 10 ms apart: a report may be early by a frame and 1 ms, and late by 250 ms."""
    facts = ClockFacts(frame_interval=0.01, recording_clock_offsets=(0.0,))
    result = estimate_offset(*reported_late(late), facts=facts)
    assert result.is_own_clock == is_own_clock
    assert result.seconds == pytest.approx(0.0 if is_own_clock else -late)
    assert result.delay == (pytest.approx(late, abs=1e-9) if is_own_clock else None)


def test_nearest_of_two_recording_clocks_is_taken():
    """Reports are 80 ms late on the first clock and 180 ms on the second."""
    facts = ClockFacts(frame_interval=0.01, recording_clock_offsets=(0.1, 0.0))
    assert estimate_offset(*reported_late(0.08), facts=facts).seconds == 0.0


@pytest.mark.parametrize(("physics_step", "delay"), [(0.03, 0.01), (0.005, 0.0)])
def test_reports_of_another_clock_wait_for_a_physics_step(physics_step, delay):
    """A report is late by half a step, a true moment by half a frame of 10 ms; what remains is the delay."""
    result = estimate_offset(*reported_late(-40.0), facts=ClockFacts(frame_interval=0.01, physics_step=physics_step))
    assert (result.seconds, result.delay) == (pytest.approx(40.0 + delay), pytest.approx(delay))


def test_given_offset_or_drift_is_no_clock_of_the_recording():
    """Both would fit the recording's own clock: the reports are 0 s late, or 0 s at first and later more."""
    facts = ClockFacts(frame_interval=0.01, recording_clock_offsets=(0.0,))
    reported, truth = reported_late(0.0)
    drifting = {key: [moment / 1.02 for moment in moments] for key, moments in truth.items()}
    assert not estimate_offset(reported, truth, known_offset=0.001, facts=facts).is_own_clock
    result = estimate_offset(drifting, truth, facts=facts)
    assert result.drift == pytest.approx(0.02) and not result.is_own_clock
