"""Every stretch of contact that a detector reports and the oracle does not gets one number, in order of time."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from cdcore.numerics import ByteArray
from cdcore.protocol import NO_FACES, Explains
from replay.comparison.episodes import column_runs
from replay.comparison.evidence import looks
from replay.comparison.outcome import Comparison, Outcome, Vector, as_vector
from replay.prepare.assembly import Assembly

if TYPE_CHECKING:
    from cdcore.narrow.mesh_stage import MeshStage

FALSE_KINDS: Final = ("nothing there", "begins early", "lasts long", "joins two")
"""By whether the report holds true contact after the stretch, and (two places on) before it."""

SAID: Final = (Outcome.BOTH, Outcome.INVENTED, Outcome.WITHIN_TOLERANCE)
"""Outcomes of frames in which the detector reports contact, or may."""

SOLIDS: Final = "its solids meet, the meshes do not"
HELD: Final = "held since its last look"
UNEXPLAINED: Final = "unexplained"

LOOKS: Final = 9
LOOKS_IN_ALL: Final = 1000
"""Frames in which the gap of a stretch is measured, and of all stretches: a distance of meshes takes milliseconds.
With more stretches than that the longest ones are measured."""


@dataclass(frozen=True)
class FalseContact:
    """One numbered false positive: a stretch of reported contact in which the oracle sees none.

    Parameters
    ----------
    number : 1, 2, ... in order of time, of one detector.
    pair : column of the pair; ``body_a`` and ``body_b`` are its names.
    first, last : first and last false frame (both included).
    start, end : seconds of the stretch.
    kind : one of ``FALSE_KINDS``.
    widest : of the frames looked at, the one in which the meshes are farthest apart.
    gap : metres between the meshes there; nan: not measured.
    point : the middle between their nearest points there, or between the bodies' origins; world metres.
    cause : why it was reported.
    """

    number: int
    pair: int
    body_a: str
    body_b: str
    first: int
    last: int
    start: float
    end: float
    kind: str
    widest: int
    gap: float
    point: Vector
    cause: str

    @property
    def frames(self) -> int:
        """How many frames are false."""
        return self.last - self.first + 1


def false_contacts(assembly: Assembly, comparison: Comparison, detector: object = None) -> tuple[FalseContact, ...]:
    """Number the false stretches of a comparison, in order of time, then pair; what a hand holds is none.

    ``detector``: the subject itself, which may explain.
    """
    outcome, times = comparison.outcome, assembly.motion.times
    found = column_runs(outcome[:, p] == Outcome.INVENTED for p in range(outcome.shape[1]))
    if not len(found):
        return ()
    # Here, since a run without a detection loads no collision engine.
    from cdcore.narrow.mesh_stage import MeshStage

    longest = np.argsort([first - last for _, first, last in found.tolist()], kind="stable")[:LOOKS_IN_ALL]
    most = min(LOOKS, LOOKS_IN_ALL // max(1, len(longest)))
    measured, meshes, made = set(longest.tolist()), MeshStage(assembly.bodies, assembly.pairs), []
    for number, (pair, first, last) in enumerate(found.tolist(), 1):
        a, b = (assembly.names[body] for body in assembly.pairs[pair].tolist())
        # Not its ends: there the pair is about to part, and the next moment is near.
        inner = (last - first) // 4
        frames = looks(first + inner, last - inner, most if number - 1 in measured else 1).tolist()
        gap, frame, point = _widest(meshes if number - 1 in measured else None, assembly, pair, frames)
        made.append(
            FalseContact(
                number, pair, a, b, first, last, float(times[first]), float(times[last]),
                _kind(outcome[:, pair], first, last), frame, gap, point, _cause(detector, assembly, pair, frame),
            )
        )  # fmt: skip
    return tuple(made)


def _widest(
    meshes: "MeshStage | None", assembly: Assembly, pair: int, frames: Sequence[int]
) -> tuple[float, int, Vector]:
    """The largest gap, the frame that shows it, and the middle of the gap."""
    if meshes is None:
        ends = assembly.motion.translations[frames[0], assembly.pairs[pair]]
        return float("nan"), frames[0], as_vector(ends.mean(axis=0))
    gaps = [(meshes.gap(assembly.motion, frame, pair), frame) for frame in frames]
    (gap, ends), frame = max(gaps, key=lambda one: one[0][0])
    return gap, frame, as_vector(ends.mean(axis=0))


def _kind(outcome: ByteArray, first: int, last: int) -> str:
    """Where in the report that holds it a stretch lies."""
    silent = np.flatnonzero(~np.isin(outcome, SAID))
    begin = silent[np.searchsorted(silent, first) - 1] + 1 if len(silent) and silent[0] < first else 0
    end = silent[np.searchsorted(silent, last)] if len(silent) and silent[-1] > last else len(outcome)
    before, after = ((part == Outcome.BOTH).any() for part in (outcome[begin:first], outcome[last + 1 : end]))
    return FALSE_KINDS[2 * int(before) + int(after)]


def _cause(detector: object, assembly: Assembly, pair: int, frame: int) -> str:
    if not isinstance(detector, Explains):
        return UNEXPLAINED
    stages = detector.explain(assembly.motion, frame, pair, NO_FACES.astype(np.int64))
    # Shape before rate: a look at solids that meet there would have said the same.
    return SOLIDS if stages.shapes_meet else HELD if stages.looked is False else UNEXPLAINED
