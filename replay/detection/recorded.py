"""The detector ``recorded``: what the engine said about contacts while the session ran, frame by frame."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from time import perf_counter
from typing import ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from cdcore import Body, Detection, Motion, Verdict, create_detector
from cdcore.protocol import Explains, Explanation, PairDetector, pair_has_pose
from cdcore.protocol.zero_order_hold import TICK_SLACK
from replay.errors import AuditError
from sessions.model.event import LiveContact

RECORDED_DETECTOR: Final = "recorded"
"""Its name in a list of detectors."""

RECORDED_LABEL: Final = "what the engine reported"
"""The answers of this detector, as a sentence names them."""

CLOCK_FACT: Final = "contacts_clock"
OFFSET_FACT: Final = "contacts_clock_offset_s"
DRIFT_FACT: Final = "contacts_clock_drift"
"""Facts of a session about the clock of its reports; without them the reports are on the recording's own clock."""


class ReportClock(StrEnum):
    """How the clock of an engine's reports was related to the recording's."""

    OWN = "own"
    GIVEN = "given"
    FITTED = "fitted"


STEP_RATES: Final = (20.0, 25.0, 30.0, 40.0, 45.0, 50.0, 60.0, 72.0, 75.0, 80.0, 90.0, 100.0, 120.0, 144.0, 200.0)
"""Physics steps a second that engines are set to; the slowest that fits is taken, for its multiples fit too."""

FEWEST_STAMPS: Final = 8
"""So many stamps that have nothing to do with a grid lie on one of these less than once in 10^7."""

STEP_SLACK_FRACTION: Final = 0.02
"""Of a step: how far a stamp may lie beside the grid."""

ReportSpan = tuple[int | None, int | None]
"""First and last nanosecond; ``None``: it began before the first report, or no end was reported."""


@dataclass(frozen=True, kw_only=True)
class RecordedSettings:
    """Known settings of the engine; none changes a verdict, all explain misses.

    ``shape``: what the engine put in place of the meshes: hull, box, sphere, capsule; ``None``: not known.
    ``rate_hz``: its fixed step; ``None``: the one on which all its stamps lie, if there is one.
    ``residual``: seconds by which its clock may still be off; ``None``: as the import found.
    """

    shape: str | None = None
    rate_hz: float | None = None
    residual: float | None = None


@dataclass(eq=False)
class _RecordedMemory:
    """Time of the last frame that was answered already."""

    last_answered_time: float


class RecordedDetector(PairDetector[RecordedSettings]):
    """Says of every frame what the engine's reports say: contact from a begin on, until the next end.

    An engine reports the end of a contact in the first step without it (Unity's ``OnCollisionExit``), so the frame at
    the stamp of an end is no contact. A stamp up to a microsecond from a frame's is at that frame: engines and scripts
    write six decimals. A contact that
    began and ended between two frames is reported at the next one. With ``shape`` a miss is explained as that collider
    would explain it. It lists no faces.
    """

    name: ClassVar[str] = RECORDED_DETECTOR
    sources: ClassVar[tuple[str, ...]] = ("the engine's own reports, as the recording holds them",)
    online: ClassVar[bool] = False
    Settings: ClassVar[type] = RecordedSettings

    def __init__(
        self,
        bodies: Sequence[Body],
        pairs: NDArray[np.int64],
        settings: RecordedSettings,
        contacts: Iterable[LiveContact],
        first_ns: int,
    ) -> None:
        super().__init__(bodies, pairs, settings)
        spans_of_pair = reported_spans(contacts)
        if not spans_of_pair:
            raise AuditError(
                "the session holds no contacts reported by an engine; add them with `replay import contacts FILE.csv`"
            )
        names = [body.name for body in bodies]
        columns = {tuple(sorted((names[i], names[j]))): column for column, (i, j) in enumerate(pairs.tolist())}
        self._report_spans = {
            columns[pair]: _spans_in_seconds(intervals, first_ns)
            for pair, intervals in spans_of_pair.items()
            if pair in columns
        }
        self._reports_of_other_pairs = sum(
            len(intervals) for pair, intervals in spans_of_pair.items() if pair not in columns
        )
        self._collider = self._make_collider()
        self._step_rate_and_phase = physics_steps(
            [span for intervals in self._report_spans.values() for span in intervals], settings.rate_hz
        )
        # A report waits for the next physics step: of the residual, one step says nothing about the clock.
        step_seconds = 0.0 if self._step_rate_and_phase is None else 1.0 / self._step_rate_and_phase[0]
        self.clock_uncertainty = max(0.0, (settings.residual or 0.0) - step_seconds)

    def _fresh_memory(self) -> _RecordedMemory:
        return _RecordedMemory(-np.inf)

    def _run(self, motion: Motion, recorded_memory: _RecordedMemory, faces: bool) -> Detection:
        """A contact between two blocks is reported in the later one."""
        del faces
        start_clock = perf_counter()
        verdict = np.full((len(motion), len(self.pairs)), Verdict.CLEAR, dtype=np.uint8)
        for column, spans in self._report_spans.items():
            for first, stop in _frame_ranges(motion.times, spans, recorded_memory.last_answered_time):
                verdict[first:stop, column] = Verdict.CONTACT
        verdict[~pair_has_pose(motion, self.pairs)] = Verdict.NO_POSE
        if len(motion):
            recorded_memory.last_answered_time = float(motion.times[-1])
        return self._detection(
            motion,
            verdict,
            containment=("refused: the engine did not say",) * len(self.pairs),
            work={
                "reported": sum(map(len, self._report_spans.values())),
                "of_other_pairs": self._reports_of_other_pairs,
            },
            seconds={"lookup": perf_counter() - start_clock},
        )

    def explain(self, motion: Motion, frame: int, pair: int, faces: NDArray[np.int64]) -> Explanation:
        """Whether the clock's uncertainty reaches from a report to the frame, and what the engine's collider says.

        The uncertainty of the clock is what its residual has beyond one physics step.
        """
        stages = Explanation()
        if self._collider is not None:
            stages = self._collider.explain(motion, frame, pair, faces)
        time, uncertainty = float(motion.times[frame]), self.clock_uncertainty
        spans = self._report_spans.get(pair, np.zeros((0, 2)))
        is_near_edge = bool((np.abs(spans - time) <= uncertainty).any()) if uncertainty > 0.0 else None
        return replace(stages, within_clock=is_near_edge)

    def has_step_between(self, start: float, end: float) -> bool | None:
        """Whether a physics step of the engine falls between two moments, in seconds; ``None``: not known."""
        if self._step_rate_and_phase is None:
            return None
        rate, phase = self._step_rate_and_phase
        return bool(np.floor((end + TICK_SLACK) * rate - phase) >= np.ceil((start - TICK_SLACK) * rate - phase))

    def ended_at_next_step(self, pair: int, moment: float) -> bool:
        """Whether the report that holds a moment, in seconds, ended at the first physics step after it."""
        spans = self._report_spans.get(pair, np.zeros((0, 2)))
        report_ends = spans[(spans[:, 0] <= moment) & (spans[:, 1] >= moment), 1]
        if self._step_rate_and_phase is None or not len(report_ends) or not np.isfinite(report_ends[0]):
            return False
        # Half a step before the end no step but an earlier one is left.
        return (
            self.has_step_between(moment, max(moment, float(report_ends[0]) - 0.5 / self._step_rate_and_phase[0]))
            is False
        )

    def _make_collider(self) -> Explains | None:
        if self.settings.shape is None:
            return None
        collider = create_detector("collider", self.bodies, pairs=self.pairs, shape=self.settings.shape)
        assert isinstance(collider, Explains)
        return collider


def recorded_detector(
    bodies: Sequence[Body],
    pairs: NDArray[np.int64],
    contacts: Iterable[LiveContact],
    first_ns: int,
    residual: float,
    settings: Mapping[str, object],
) -> RecordedDetector:
    """The detector of a session's reports, which are on the session's clock; ``first_ns`` is the stamp of second 0.

    ``residual`` is the uncertainty of the reports' clock in seconds, as the import measured it. Raises ``AuditError``:
    there are no reports, or a setting it does not have.
    """
    known_settings = RecordedSettings.__dataclass_fields__
    for setting_name in settings:
        if setting_name not in known_settings:
            raise AuditError(
                f"detector {RECORDED_DETECTOR!r} has no setting {setting_name!r}; it has: {', '.join(known_settings)}"
            )
    recorded_settings = RecordedSettings(**settings)  # type: ignore[arg-type]
    if recorded_settings.residual is None:
        recorded_settings = replace(recorded_settings, residual=residual)
    return RecordedDetector(bodies, pairs, recorded_settings, contacts, first_ns)


def physics_steps(report_stamps: Sequence[NDArray[np.float64]], rate_hz: float | None) -> tuple[float, float] | None:
    """Steps a second, and the share of a step by which they begin after second 0; ``None``: no rate fits all stamps.

    ``report_stamps`` (2,) seconds each. Engines report from within their steps, so that their stamps lie on a grid.
    """
    moments = np.unique(np.round(np.concatenate([np.zeros(0), *report_stamps]), 5))
    moments = moments[np.isfinite(moments)]
    candidate_rates = (rate_hz,) if rate_hz is not None else STEP_RATES if len(moments) >= FEWEST_STAMPS else ()
    for rate in candidate_rates:
        phases = np.exp(2j * np.pi * moments * rate)
        phase = np.angle(phases.sum()) / (2 * np.pi)
        if (np.abs(np.angle(phases * np.exp(-2j * np.pi * phase))) <= 2 * np.pi * STEP_SLACK_FRACTION).all():
            return rate, float(phase)
    return None if rate_hz is None else (rate_hz, 0.0)


def _spans_in_seconds(spans: Sequence[ReportSpan], first_ns: int) -> NDArray[np.float64]:
    """Spans (n, 2) in seconds of the session, from a begin until an end; open ends at infinity.

    Both lie a microsecond earlier, so that a frame whose stamp is rounded differently is at the stamp.
    """
    seconds = [
        [
            open_bound if bound_ns is None else (bound_ns - first_ns) / 1e9 - TICK_SLACK
            for bound_ns, open_bound in zip(span, (-np.inf, np.inf), strict=True)
        ]
        for span in spans
    ]
    return np.array(seconds).reshape(-1, 2)


def _frame_ranges(
    times: NDArray[np.float64], spans: NDArray[np.float64], last_answered_time: float
) -> Iterator[tuple[int, int]]:
    """First frame and the one after the last of every span that has a frame here; a short one has the next."""
    first = np.searchsorted(times, spans[:, 0])
    stop = np.searchsorted(times, spans[:, 1])
    is_new = spans[:, 0] > last_answered_time
    for start, end, is_fresh in zip(first.tolist(), stop.tolist(), is_new.tolist(), strict=True):
        if is_fresh and start < len(times):
            end = max(end, start + 1)
        if end > start:
            yield start, end


def reported_spans(contacts: Iterable[LiveContact]) -> dict[tuple[str, str], list[ReportSpan]]:
    """Spans per pair of names (sorted), in order of time.

    A second begin within a contact changes nothing, nor does a second end. A pair whose first report is an end, or
    that it stays, was in contact from the start.
    """
    spans: dict[tuple[str, str], list[ReportSpan]] = {}
    begun_stamps: dict[tuple[str, str], int | None] = {}
    for contact in sorted(contacts, key=lambda reported: reported.time_ns):
        pair = (min(contact.body_a, contact.body_b), max(contact.body_a, contact.body_b))
        is_first = pair not in spans
        intervals = spans.setdefault(pair, [])
        if contact.phase == "exit":
            if pair in begun_stamps or is_first:
                intervals.append((begun_stamps.pop(pair, None), contact.time_ns))
        elif pair not in begun_stamps:
            begun_stamps[pair] = None if is_first and contact.phase == "stay" else contact.time_ns
    for pair, start in begun_stamps.items():
        spans[pair].append((start, None))
    return spans
