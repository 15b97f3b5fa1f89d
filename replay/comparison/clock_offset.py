"""The offset of another clock: the shift at which most reported begins and ends fall on true ones; and its drift."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from replay.errors import AuditError

WINDOW: Final = 0.05
"""Seconds within which differences support the same shift: four frames at 90 Hz, the delay of a slow engine."""

MOST_DRIFT: Final = 0.03
"""Seconds in a second: no clock that is read as seconds runs more wrong than this."""

FEWEST: Final = 6
"""Reports with a partner in question, three contacts: through fewer, a line with a drift passes by chance."""

WORTH_A_DRIFT: Final = 1e-3
"""Seconds off on average below which no drift is looked for: true begins and ends are known to a frame."""

Moments = Mapping[tuple[str, str, str], Sequence[float]]
"""(body, body, ``begin`` or ``end``), names sorted -> seconds."""

SAY_IT: Final = "say the offset with --offset SECONDS"


@dataclass(frozen=True)
class ClockOffset:
    """What to add to the other clock."""

    seconds: float  # added to its first stamp; to later ones ``drift`` more for every second after it
    # the middle 95 % of the reports that found a partner lie within this many seconds of it after that; ``None``: none
    # did
    residual: float | None
    # matched, of: reports that found a partner within ``WINDOW``, and reports there are
    matched: int
    of: int
    drift: float = 0.0  # seconds a second; 0 where none fits much better
    first: float = 0.0  # the other clock's seconds at its first report
    rivals: int = 0  # other offsets at which as many reports find a partner

    def at(self, seconds: float) -> float:
        """What to add to a stamp of the other clock."""
        return self.seconds + self.drift * (seconds - self.first)

    def __str__(self) -> str:
        said = f"clock offset {self.seconds:+.4f} s"
        if self.drift:
            said += f" at the first report, drift {100 * self.drift:+.3f} %"
        far = f"{1e3 * WINDOW:g} ms"
        if self.residual is None:
            return f"{said}, residual unknown: none of {self.of} begins and ends is within {far} of a true one"
        said += f", residual {1e3 * self.residual:.1f} ms of {self.matched} of {self.of} begins and ends"
        if self.matched < self.of:
            said += f"; {self.of - self.matched} are left out, more than {far} from every true one of their pair"
        if self.rivals:
            said += f"; {self.rivals} other offsets fit as many, the smallest was taken: if it is wrong, {SAY_IT}"
        return said


def estimate_offset(reported: Moments, truth: Moments, given: float | None = None) -> ClockOffset:
    """Estimate the offset of a clock, and its drift, from the begins and ends of contacts that two sides report.

    A constant delay of the engine and an offset of its clock have the same effect: the estimate is their sum. Contacts
    that come at equal intervals support several shifts equally; of those the smallest is taken.

    ``reported``, ``truth``: moments per pair and kind, each on its own clock; ``given``: take this offset, without a
    drift, and only say how well it fits.

    Raises ``AuditError``: at most one report has a partner, and one alone fits every clock.
    """
    first = min((moment for moments in reported.values() for moment in moments), default=0.0)
    partners, offset, drift, rivals = _Partners(reported, truth, first), given or 0.0, 0.0, 0
    if given is None:
        if not len(partners.gap):
            raise AuditError(
                "no reported contact is of a pair that truly touches, so its clock cannot be estimated; "
                f"check the body names, or {SAY_IT}"
            )
        offset, rivals = _densest(partners.gap)
        still = np.minimum(partners.nearest(offset, 0.0), WINDOW).mean()
        moving = _drifting(partners)
        if still > WORTH_A_DRIFT and 2.0 * np.minimum(partners.nearest(*moving), WINDOW).mean() < still:
            (offset, drift), rivals = moving, 0
    nearest = partners.nearest(offset, drift)
    held = nearest[nearest <= WINDOW]
    if len(held) < 2 and given is None:
        raise AuditError(f"one report alone fits every clock, so no offset can be estimated; {SAY_IT}")
    residual = float(np.quantile(held, 0.95)) if len(held) else None
    return ClockOffset(offset, residual, len(held), sum(map(len, reported.values())), drift, first, rivals)


class _Partners:
    """The true moments that each of R reports may be of, N in all.

    ``gap``: (N,) seconds, true minus reported. ``later``: (N,) seconds after the first report. ``report``: (N,) number.
    """

    def __init__(self, reported: Moments, truth: Moments, first: float) -> None:
        said = [(moment, true) for key, moments in reported.items() if (true := truth.get(key)) for moment in moments]
        sizes = [len(true) for _, true in said]
        self.report = np.repeat(np.arange(len(said)), sizes)
        self.later = np.repeat(np.array([moment for moment, _ in said], dtype=np.float64) - first, sizes)
        self.gap = np.array([one - moment for moment, true in said for one in true], dtype=np.float64)

    def nearest(self, offset: float, drift: float) -> NDArray[np.float64]:
        """How far each report is from its nearest under a clock, (R,) seconds."""
        nearest = np.full(int(self.report.max(initial=-1)) + 1, np.inf)
        np.minimum.at(nearest, self.report, np.abs(self.gap - offset - drift * self.later))
        return nearest


def _supporters(gaps: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Differences in order, and how many lie within the window after each."""
    gaps = np.sort(gaps)
    return gaps, np.searchsorted(gaps, gaps + WINDOW, side="right") - np.arange(len(gaps))


def _densest(gaps: NDArray[np.float64]) -> tuple[float, int]:
    """The middle of the window that holds most differences, of equal ones the nearest to no shift; and the others."""
    gaps, count = _supporters(gaps)
    middle = [float(np.median(gaps[k : k + count[k]])) for k in np.flatnonzero(count == count.max()).tolist()]
    return min(middle, key=abs), int((np.diff(middle) > WINDOW).sum())


def _drifting(partners: _Partners) -> tuple[float, float]:
    """Offset and drift of the line that most differences are near; no drift where there are too few for one."""
    gap, later = partners.gap, partners.later
    offset, drift = _densest(gap)[0], 0.0
    if partners.report[-1] + 1 < FEWEST or not later.any():
        return offset, drift
    drifts = np.arange(-MOST_DRIFT, MOST_DRIFT, WINDOW / later.max())
    drift = float(max(drifts, key=lambda one: _supporters(gap - one * later)[1].max()))
    offset, _ = _densest(gap - drift * later)
    for _ in range(3):
        left, nearest = np.abs(gap - offset - drift * later), partners.nearest(offset, drift)
        taken = (left <= WINDOW) & (left == nearest[partners.report])
        drift, offset = np.polyfit(later[taken], gap[taken], 1).tolist()
    return offset, drift
