"""Contents of a session, counted in one pass and without judging: a broken recording has information too."""

from collections import Counter
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sessions import Session, Status
from sessions.doctor.timing import gap_rows, typical_step
from sessions.importers.ledger import FACT, ledger_of
from sessions.model.assumption import ASSUMPTIONS_FACT
from sessions.model.constants import BLOCK_FRAMES
from sessions.scene_files.answers import recording_assumptions


@dataclass(frozen=True)
class ClockInfo:
    """The steps of one clock.

    Parameters
    ----------
    count : stamps.
    duration : seconds from the first to the last.
    rate_hz : one over the typical step; 0 with fewer than two stamps.
    gaps : what the doctor calls so; ``longest_gap`` in seconds.
    not_forward : steps that do not go forward.
    """

    count: int
    duration: float
    rate_hz: float
    gaps: int
    longest_gap: float
    not_forward: int

    @classmethod
    def of(cls, stamps: NDArray[np.int64]) -> "ClockInfo":
        """Count the steps of stamps (n,), ns."""
        step = np.diff(stamps)
        forward_steps = step[step > 0]
        typical_step_ns = typical_step(stamps)
        gaps = step[gap_rows(stamps)]
        duration = float(stamps.max() - stamps.min()) / 1e9 if len(stamps) else 0.0
        longest = float(gaps.max(initial=0)) / 1e9
        return cls(
            len(stamps),
            duration,
            1e9 / typical_step_ns if typical_step_ns else 0.0,
            len(gaps),
            longest,
            len(step) - len(forward_steps),
        )


def session_info(session: Session) -> dict[str, Any]:
    """Everything that ``replay info`` prints, as JSON can hold it."""
    stamps = [np.zeros(0, dtype=np.int64)]
    samples = [[np.zeros(0, dtype=np.int64)] for _ in session.names]
    statuses = np.zeros((len(session.names), len(Status)), dtype=np.int64)
    for frames in session.blocks(BLOCK_FRAMES):
        stamps.append(frames.stamp_ns)
        for column, status in enumerate(frames.status.T):
            statuses[column] += np.bincount(status, minlength=len(Status))[: len(Status)]
            samples[column].append(frames.stamp_ns[status != Status.ABSENT])
    clock = ClockInfo.of(frames_ns := np.concatenate(stamps))
    tracks = {name: ClockInfo.of(np.concatenate(samples[column])) for column, name in enumerate(session.names)}
    fixed_names = [body.id for body in session.scene.bodies if body.fixed is not None and body.id not in tracks]
    first_ns = int(frames_ns[0]) if clock.count else 0
    events = Counter(event.name for event in session.events)
    return {
        "origin": session.origin,
        "scene": session.scene.name,
        "first_stamp_ns": first_ns if clock.count else None,
        "frames": vars(clock),
        "bodies": [
            _body_info(session, name, tracks[name], statuses[column]) for column, name in enumerate(session.names)
        ]
        + [_body_info(session, name, None, None) for name in fixed_names],
        "intervals": [
            {
                "kind": interval.kind,
                "name": interval.name,
                "start": (interval.start_ns - first_ns) / 1e9,
                "end": (interval.end_ns - first_ns) / 1e9,
            }
            for interval in session.intervals
        ],
        "gaze": [
            {"participant": name, **vars(ClockInfo.of(gaze.times_ns)), "valid": int(gaze.valid.sum())}
            for name, gaze in session.gaze.items()
        ],
        "scalars": [
            {"name": name, "unit": scalar.unit, **vars(ClockInfo.of(scalar.times_ns)), **_finite_range(scalar.values)}
            for name, scalar in session.scalars.items()
        ],
        "events": dict(sorted(events.items(), key=lambda item: (-item[1], item[0]))),
        "ledger": _import_accounts(session),
        "assumptions": [
            {**row.as_json(), "what": row.title, "said": row.sentence} for row in recording_assumptions(session)
        ],
        "facts": {key: value for key, value in session.facts.items() if key not in (FACT, ASSUMPTIONS_FACT)},
    }


def _import_accounts(session: Session) -> list[dict[str, Any]] | None:
    """The accounts of the import that the session comes from; ``None`` where they are not known."""
    ledger = ledger_of(session.facts)
    return None if ledger is None else [vars(entry) for entry in ledger]


def _finite_range(values: NDArray[np.float64]) -> dict[str, float | None]:
    """The least and the largest number; ``None`` where there is none."""
    finite_values = values[np.isfinite(values)]
    return (
        {"least": float(finite_values.min()), "largest": float(finite_values.max())}
        if len(finite_values)
        else dict.fromkeys(RANGE_KEYS)
    )


RANGE_KEYS: Final = ("least", "largest")


def _body_info(
    session: Session, name: str, track: ClockInfo | None, statuses: NDArray[np.int64] | None
) -> dict[str, Any]:
    scene_body, mesh = session.scene.body(name), session.meshes.get(name)
    status_counts = (
        {}
        if statuses is None
        else {status.name.lower(): int(statuses[status]) for status in Status if statuses[status]}
    )
    return {
        "name": name,
        "faces": None if mesh is None else len(mesh.faces),
        "size": None if mesh is None else (mesh.bounds[1] - mesh.bounds[0]).tolist(),
        "proxy": scene_body is not None and scene_body.proxy,
        "fixed": track is None,
        "samples": status_counts,
        **({} if track is None else {"rate_hz": track.rate_hz, "gaps": track.gaps, "longest_gap": track.longest_gap}),
    }
