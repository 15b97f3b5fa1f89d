"""Gaze and numbers that a source holds beside poses, on their way into a session; what is dropped is counted."""

from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sessions.geometry.rotations import rotated
from sessions.importers.finish import Imported, counted, increasing
from sessions.model.track import GazeTrack, ScalarTrack, Track

Numbers = NDArray[np.float64]
Stamps = NDArray[np.int64]
Rows = NDArray[np.bool_]
NEAR_NS: Final = 50_000_000


@dataclass
class BesidePoses:
    """Collects them; a name that is there already gets a number."""

    gaze: dict[str, GazeTrack] = field(default_factory=dict)
    scalars: dict[str, ScalarTrack] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def scalar(self, name: str, times_ns: Stamps, values: Numbers, unit: str = "") -> None:
        """A number over time, (n,) and (n,); rows whose stamp does not increase are dropped."""
        keep = increasing(times_ns)
        self.notes += counted(f"scalar {name}", int((~keep).sum()), 0)
        self.scalars[_free(name, self.scalars)] = ScalarTrack(times_ns[keep], values[keep], unit)

    def looked(
        self, participant: str, times_ns: Stamps, origins: Numbers, directions: Numbers, valid: NDArray[np.bool_]
    ) -> None:
        """Where somebody looked, (n, 3) in the canonical frame; directions get length 1, what is no ray is lost."""
        keep = increasing(times_ns)
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            unit = directions / np.sqrt((directions**2).sum(axis=1, keepdims=True))
        track = GazeTrack(times_ns[keep], origins[keep], unit[keep], valid[keep])
        flagged = int((track.valid & ~track.usable).sum())
        self.notes += counted(f"gaze of {participant}", int((~keep).sum()), 0)
        self.notes += [f"gaze of {participant}: {flagged} samples flagged as lost that hold no ray"] * (flagged > 0)
        lost = GazeTrack(track.times_ns, track.origins, track.directions, track.usable)
        self.gaze[_free(participant, self.gaze)] = lost

    def put_into(self, samples: Imported, *, stated: bool = True) -> Imported:
        """What was read, with these beside it; ``stated``: the source says in which frame its gaze is."""
        done, facts = (*samples.conversions, *self.notes), dict(samples.facts)
        if self.gaze and not stated:
            facts["assumed"] = "; ".join([*filter(None, [facts.get("assumed")]), "gaze in the frame of the poses"])
        return replace(samples, conversions=done, facts=facts, gaze=self.gaze, scalars=self.scalars)


def carried(track: Track, times_ns: Stamps, origins: Numbers, directions: Numbers) -> tuple[Numbers, Numbers, Rows]:
    """Rays of a body's frame, (n, 3) each, in the world, and where the body has a pose within 50 ms, (n,)."""
    middles = track.times_ns[:-1] + np.diff(track.times_ns) // 2
    rows = np.searchsorted(middles, times_ns)
    turn, near = track.quaternions_xyzw[rows], np.abs(track.times_ns[rows] - times_ns) <= NEAR_NS
    return track.positions[rows] + rotated(turn, origins), rotated(turn, directions), near & track.valid[rows]


def _free(name: str, taken: dict[str, Any]) -> str:
    if name not in taken:
        return name
    return next(new for number in range(2, len(taken) + 3) if (new := f"{name} {number}") not in taken)
