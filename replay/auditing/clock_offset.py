"""The offset and the drift of an engine's clock, apart from the delay with which the engine reports.

Both move a report: the shift at which most reported begins and ends fall on true ones is their sum. Where that sum is
one that a delay alone explains, the clock is the recording's own and the offset is 0. Otherwise the part that the
engine's wait for its next physics step explains is delay, and the rest is offset.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from replay import words
from replay.auditing.delay import LONGEST_DELAY_S
from replay.errors import AuditError

SUPPORT_WINDOW_S: Final = 0.05
"""Seconds within which differences support the same shift: four frames at 90 Hz, the delay of a slow engine."""

MOST_DRIFT: Final = 0.03
"""Seconds in a second: no clock that is read as seconds runs more wrong than this."""

LEAST_MATCHED_REPORTS: Final = 6
"""Reports with a partner in question, three contacts: through fewer, a line with a drift passes by chance."""

LEAST_DRIFT_RESIDUAL_S: Final = 1e-3
"""Seconds off on average below which no drift is looked for: true begins and ends are known to a frame."""

Moments = Mapping[tuple[str, str, str], Sequence[float]]
"""(body, body, ``begin`` or ``end``), names sorted -> seconds."""

OFFSET_HINT: Final = "give the offset with --offset SECONDS"


@dataclass(frozen=True)
class ClockOffset:
    """Offset and drift between the other clock and the recording's."""

    seconds: float  # added to its first stamp; to later ones ``drift`` more for every second after it
    # the middle 95 % of the reports that found a partner lie within this many seconds of it after that; ``None``: none
    # did
    residual: float | None
    # matched, reports: reports that found a partner within ``SUPPORT_WINDOW_S``, and reports there are
    matched: int
    reports: int
    drift: float = 0.0  # seconds a second; 0 where none fits much better
    first: float = 0.0  # the other clock's seconds at its first report
    rivals: int = 0  # other offsets at which as many reports find a partner
    is_own_clock: bool = False  # whether the engine's clock was taken for the recording's own
    # median seconds from a true begin or end to its report, after the offset; ``None``: not told from the offset
    delay: float | None = None

    def at(self, seconds: float) -> float:
        """Seconds to add to a stamp of the other clock."""
        return self.seconds + self.drift * (seconds - self.first)

    def __str__(self) -> str:
        text = f"clock offset {words.decimal(self.seconds, 4, signed=True)} s"
        if self.is_own_clock:
            text += " (taken for the recording's own clock)"
        if self.drift:
            text += f" at the first report, drift {words.decimal(100 * self.drift, 3, signed=True)} %"
        if self.delay is not None:
            text += f", {delay_text(self.delay)}"
        window = f"{1e3 * SUPPORT_WINDOW_S:g} ms"
        if self.residual is None:
            return f"{text}, residual unknown: all {self.reports} begins and ends are over {window} from a true one"
        text += (
            f", residual {words.decimal(1e3 * self.residual, 1)} ms of {self.matched} of {self.reports} begins and ends"
        )
        if self.matched < self.reports:
            text += (
                f"; {self.reports - self.matched} are left out, more than {window} from every true one of their pair"
            )
        if self.rivals:
            text += f"; {self.rivals} other offsets fit as many, the smallest was taken: if it is wrong, {OFFSET_HINT}"
        elif self.is_own_clock and self.delay:
            text += f"; if the engine had another clock, {OFFSET_HINT}"
        return text


def delay_text(seconds: float) -> str:
    """``reports 4.5 ms late in the median``."""
    if round(1e4 * seconds) == 0:
        return "reports on time in the median"
    return f"reports {words.decimal(1e3 * abs(seconds), 1)} ms {'late' if seconds > 0 else 'early'} in the median"


@dataclass(frozen=True)
class ClockFacts:
    """Facts about the two clocks, from before anything is fitted."""

    frame_interval: float = 0.0  # usual seconds from a recorded frame to the next: a true moment is known no better
    physics_step: float | None = None  # seconds of the engine's physics step; ``None``: not known
    recording_clock_offsets: Sequence[float] = ()  # offsets that the recording's own clock would have


NO_FACTS: Final = ClockFacts()


def estimate_offset(
    reported_moments: Moments,
    reference_moments: Moments,
    known_offset: float | None = None,
    facts: ClockFacts = NO_FACTS,
) -> ClockOffset:
    """Estimate the offset of a clock, and its drift, from the begins and ends of contacts that two sides report.

    A delay that is the same for all reports and longer than a physics step cannot be told from an offset of another
    clock. Contacts that come at equal intervals support several shifts equally; of those the smallest is taken.

    ``reported_moments``, ``reference_moments``: moments per pair and kind, each on its own clock; ``known_offset``:
    take this offset, without a drift, and only say how well it fits; ``facts``: see ``ClockFacts``.

    Raises ``AuditError``: at most one report has a partner, and one alone fits every clock.
    """
    first_moment = min((moment for moments in reported_moments.values() for moment in moments), default=0.0)
    partners, shift, drift, rivals = (
        _Partners(reported_moments, reference_moments, first_moment),
        known_offset or 0.0,
        0.0,
        0,
    )
    if known_offset is None:
        if not len(partners.gap):
            raise AuditError(
                "no reported contact is of a pair that truly touches, so its clock cannot be estimated; "
                f"check the body names, or {OFFSET_HINT}"
            )
        shift, rivals = _densest_window(partners.gap)
        mean_distance_without_drift = np.minimum(partners.nearest(shift, 0.0), SUPPORT_WINDOW_S).mean()
        fitted_line = _fitted_line(partners)
        if (
            mean_distance_without_drift > LEAST_DRIFT_RESIDUAL_S
            and 2.0 * np.minimum(partners.nearest(*fitted_line), SUPPORT_WINDOW_S).mean() < mean_distance_without_drift
        ):
            (shift, drift), rivals = fitted_line, 0
    partner_distances = partners.nearest(shift, drift)
    paired_distances = partner_distances[partner_distances <= SUPPORT_WINDOW_S]
    if len(paired_distances) < 2 and known_offset is None:
        raise AuditError(
            f"fewer than two reports fit true contacts with one offset, so none is estimated; {OFFSET_HINT}"
        )
    recording_clock_offset = None if known_offset is not None or drift else _recording_clock_offset(shift, facts)
    if recording_clock_offset is not None:
        offset, rivals = recording_clock_offset, 0
    elif known_offset is not None or facts.physics_step is None:
        offset = shift
    else:
        # A report waits for the next step, a true moment for the next frame: by half of each in the mean.
        offset = shift + max(0.0, facts.physics_step - facts.frame_interval) / 2.0
    # Fitted without a step, the offset holds the delay too, and no report would seem late.
    is_separate_clock = recording_clock_offset is not None or known_offset is not None or facts.physics_step is not None
    lateness = partners.lateness(shift, drift, offset)
    return ClockOffset(
        seconds=offset,
        residual=float(np.quantile(paired_distances, 0.95)) if len(paired_distances) else None,
        matched=len(paired_distances),
        reports=sum(map(len, reported_moments.values())),
        drift=drift,
        first=first_moment,
        rivals=rivals,
        is_own_clock=recording_clock_offset is not None,
        delay=float(np.median(lateness)) if is_separate_clock and len(lateness) else None,
    )


def _recording_clock_offset(shift: float, facts: ClockFacts) -> float | None:
    """The offset of the recording's own clock from which a delay of the engine alone explains a shift, if any."""
    # Half a frame early: the engine saw the contact before the next frame was recorded.
    offsets = [
        offset
        for offset in facts.recording_clock_offsets
        if -(facts.frame_interval + LEAST_DRIFT_RESIDUAL_S) <= offset - shift <= LONGEST_DELAY_S
    ]
    return min(offsets, key=lambda offset: abs(offset - shift), default=None)


class _Partners:
    """The true moments that each of R reports may be of, N in all.

    ``gap``: (N,) seconds, true minus reported. ``seconds_after_first``: (N,) seconds after the first report.
    ``report_indices``: (N,) number.
    """

    def __init__(self, reported_moments: Moments, reference_moments: Moments, first_moment: float) -> None:
        pairs = [
            (moment, reference_seconds)
            for key, moments in reported_moments.items()
            if (reference_seconds := reference_moments.get(key))
            for moment in moments
        ]
        sizes = [len(true) for _, true in pairs]
        self.report_indices = np.repeat(np.arange(len(pairs)), sizes)
        self.seconds_after_first = np.repeat(
            np.array([moment for moment, _ in pairs], dtype=np.float64) - first_moment, sizes
        )
        self.gap = np.array([value - moment for moment, true in pairs for value in true], dtype=np.float64)

    def lateness(self, shift: float, drift: float, offset: float) -> NDArray[np.float64]:
        """Seconds from its partner to each report that has one under ``shift``, with the ``offset`` added."""
        gap = self.gap - shift - drift * self.seconds_after_first
        is_paired = (np.abs(gap) <= SUPPORT_WINDOW_S) & (np.abs(gap) == self.nearest(shift, drift)[self.report_indices])
        return offset - shift - gap[is_paired]

    def nearest(self, offset: float, drift: float) -> NDArray[np.float64]:
        """How far each report is from its nearest under a clock, (R,) seconds."""
        nearest_distances = np.full(int(self.report_indices.max(initial=-1)) + 1, np.inf)
        np.minimum.at(
            nearest_distances, self.report_indices, np.abs(self.gap - offset - drift * self.seconds_after_first)
        )
        return nearest_distances


def _counts_in_window(gaps: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Differences in order, and how many lie within the window after each."""
    gaps = np.sort(gaps)
    return gaps, np.searchsorted(gaps, gaps + SUPPORT_WINDOW_S, side="right") - np.arange(len(gaps))


def _densest_window(gaps: NDArray[np.float64]) -> tuple[float, int]:
    """The middle of the window that holds most differences, of equal ones the nearest to no shift; and the others."""
    gaps, supporters = _counts_in_window(gaps)
    window_medians = [
        float(np.median(gaps[k : k + supporters[k]])) for k in np.flatnonzero(supporters == supporters.max()).tolist()
    ]
    return min(window_medians, key=abs), int((np.diff(window_medians) > SUPPORT_WINDOW_S).sum())


def _fitted_line(partners: _Partners) -> tuple[float, float]:
    """Offset and drift of the line that most differences are near; no drift where there are too few for one."""
    gap, seconds_after_first = partners.gap, partners.seconds_after_first
    offset, drift = _densest_window(gap)[0], 0.0
    if partners.report_indices[-1] + 1 < LEAST_MATCHED_REPORTS or not seconds_after_first.any():
        return offset, drift
    drifts = np.arange(-MOST_DRIFT, MOST_DRIFT, SUPPORT_WINDOW_S / seconds_after_first.max())
    drift = float(max(drifts, key=lambda value: _counts_in_window(gap - value * seconds_after_first)[1].max()))
    offset, _ = _densest_window(gap - drift * seconds_after_first)
    for _ in range(3):
        remaining_gaps, nearest = np.abs(gap - offset - drift * seconds_after_first), partners.nearest(offset, drift)
        is_matched = (remaining_gaps <= SUPPORT_WINDOW_S) & (remaining_gaps == nearest[partners.report_indices])
        if len(np.unique(seconds_after_first[is_matched])) < 2:
            break  # Reports of one moment lie on lines of any drift.
        drift, offset = np.polyfit(seconds_after_first[is_matched], gap[is_matched], 1).tolist()
    return offset, drift
