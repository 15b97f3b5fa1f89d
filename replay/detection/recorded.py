"""The detector ``recorded``: what the engine said about contacts while the session ran, frame by frame."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from cdcore import Body, Detection, Motion, Verdict, create_detector
from cdcore.protocol import Explains, Explanation, PairDetector, pair_has_pose
from cdcore.protocol.blocks import TICK_SLACK
from replay.errors import AuditError
from sessions.model.live_contact import LiveContact

RECORDED: Final = "recorded"
"""Its name in a list of detectors."""

Span = tuple[int | None, int | None]
"""First and last nanosecond; ``None``: it began before the first report, or no end was reported."""


@dataclass(frozen=True, kw_only=True)
class RecordedSettings:
    """What is known about the engine; none of it changes a verdict, all of it explains misses.

    ``shape``: what the engine put in place of the meshes: hull, box, sphere, capsule; ``None``: not known.
    ``rate_hz``: its fixed step; ``None``: not known.
    ``residual``: seconds by which its clock may still be off; ``None``: as the import found.
    """

    shape: str | None = None
    rate_hz: float | None = None
    residual: float | None = None


@dataclass(eq=False)
class _RecordedMemory:
    """Time of the last frame that was answered already."""

    before: float


class RecordedDetector(PairDetector[RecordedSettings]):
    """Says of every frame what the engine's reports say: contact from a begin to the next end, both included.

    A stamp up to a microsecond from a frame's is at that frame: engines and scripts write six decimals. A contact that
    began and ended between two frames is reported at the next one. With ``shape`` or ``rate_hz`` a miss
    is explained as that collider would explain it. It lists no faces.
    """

    name: ClassVar[str] = RECORDED
    online: ClassVar[bool] = False
    Settings: ClassVar[type] = RecordedSettings

    def __init__(
        self, bodies: Sequence[Body], pairs: NDArray[np.int64], settings: RecordedSettings,
        contacts: Iterable[LiveContact], first_ns: int,
    ) -> None:  # fmt: skip
        super().__init__(bodies, pairs, settings)
        spans = reported_spans(contacts)
        if not spans:
            raise AuditError(
                "the session holds no contacts reported by an engine; add them with `replay import contacts FILE.csv`"
            )
        names = [body.name for body in bodies]
        columns = {tuple(sorted((names[i], names[j]))): column for column, (i, j) in enumerate(pairs.tolist())}
        self._spans = {columns[pair]: _seconds(found, first_ns) for pair, found in spans.items() if pair in columns}
        self._elsewhere = sum(len(found) for pair, found in spans.items() if pair not in columns)
        self._collider = self._make_collider()

    def _fresh_memory(self) -> _RecordedMemory:
        return _RecordedMemory(-np.inf)

    def _run(self, motion: Motion, memory: _RecordedMemory, faces: bool) -> Detection:
        """A contact between two blocks is reported in the later one."""
        del faces
        begin = perf_counter()
        verdict = np.full((len(motion), len(self.pairs)), Verdict.CLEAR, dtype=np.uint8)
        for column, spans in self._spans.items():
            for first, stop in _rows(motion.times, spans, memory.before):
                verdict[first:stop, column] = Verdict.CONTACT
        verdict[~pair_has_pose(motion, self.pairs)] = Verdict.NO_POSE
        if len(motion):
            memory.before = float(motion.times[-1])
        return self._detection(
            motion,
            verdict,
            containment=("refused: the engine did not say",) * len(self.pairs),
            work={"reported": sum(map(len, self._spans.values())), "of_other_pairs": self._elsewhere},
            seconds={"lookup": perf_counter() - begin},
        )

    def explain(self, motion: Motion, frame: int, pair: int, faces: NDArray[np.int64]) -> Explanation:
        """Whether the frame is within the clock's residual of a report, and what the engine's collider says of it."""
        stages = Explanation()
        if self._collider is not None:
            stages = self._collider.explain(motion, frame, pair, faces)
        time, residual = float(motion.times[frame]), self.settings.residual or 0.0
        spans = self._spans.get(pair, np.zeros((0, 2)))
        near = bool((np.abs(spans - time) <= residual).any()) if residual > 0.0 else None
        return replace(stages, within_clock=near)

    def _make_collider(self) -> Explains | None:
        if self.settings.shape is None and self.settings.rate_hz is None:
            return None
        shape = self.settings.shape or "mesh"
        made = create_detector("collider", self.bodies, pairs=self.pairs, shape=shape, rate_hz=self.settings.rate_hz)
        assert isinstance(made, Explains)
        return made


def recorded_detector(
    bodies: Sequence[Body], pairs: NDArray[np.int64], contacts: Iterable[LiveContact], first_ns: int, residual: float,
    settings: Mapping[str, object],
) -> RecordedDetector:  # fmt: skip
    """The detector of a session's reports, which are on the session's clock; ``first_ns`` is the stamp of second 0.

    ``residual`` is the uncertainty of the reports' clock in seconds, as the import measured it. Raises ``AuditError``:
    there are no reports, or a setting it does not have.
    """
    known = RecordedSettings.__dataclass_fields__
    for name in settings:
        if name not in known:
            raise AuditError(f"detector {RECORDED!r} has no setting {name!r}; it has: {', '.join(known)}")
    made = RecordedSettings(**settings)  # type: ignore[arg-type]
    if made.residual is None:
        made = replace(made, residual=residual)
    return RecordedDetector(bodies, pairs, made, contacts, first_ns)


def _seconds(spans: Sequence[Span], first_ns: int) -> NDArray[np.float64]:
    """Spans (n, 2) in seconds of the session, open ends at infinity; a stamp near a frame's is made to hold it."""
    return np.array(
        [
            [
                far if at is None else (at - first_ns) / 1e9 + np.copysign(TICK_SLACK, far)
                for at, far in zip(span, (-np.inf, np.inf), strict=True)
            ]
            for span in spans
        ]
    ).reshape(-1, 2)


def _rows(times: NDArray[np.float64], spans: NDArray[np.float64], before: float) -> Iterator[tuple[int, int]]:
    """First frame and the one after the last of every span that has a frame here; a short one has the next."""
    first = np.searchsorted(times, spans[:, 0])
    stop = np.searchsorted(times, spans[:, 1], side="right")
    fresh = spans[:, 0] > before
    for start, end, new in zip(first.tolist(), stop.tolist(), fresh.tolist(), strict=True):
        if new and start < len(times):
            end = max(end, start + 1)
        if end > start:
            yield start, end


def reported_spans(contacts: Iterable[LiveContact]) -> dict[tuple[str, str], list[Span]]:
    """Spans per pair of names (sorted), in order of time.

    A second begin within a contact changes nothing, nor does a second end. A pair whose first report is an end, or
    that it stays, was in contact from the start.
    """
    spans: dict[tuple[str, str], list[Span]] = {}
    begun: dict[tuple[str, str], int | None] = {}
    for contact in sorted(contacts, key=lambda one: one.time_ns):
        pair = (min(contact.body_a, contact.body_b), max(contact.body_a, contact.body_b))
        first = pair not in spans
        found = spans.setdefault(pair, [])
        if contact.phase == "exit":
            if pair in begun or first:
                found.append((begun.pop(pair, None), contact.time_ns))
        elif pair not in begun:
            begun[pair] = None if first and contact.phase == "stay" else contact.time_ns
    for pair, start in begun.items():
        spans[pair].append((start, None))
    return spans
