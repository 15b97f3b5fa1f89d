"""The oracle as the reference of other answers, and what is within tolerance of it: less than tau, on exact geometry.

A contact is excused when no face pair is deeper than tau and a move of the surfaces by tau ends it; a gap, when some
face pair is at most tau apart. The move is asked for because face pairs of cubes with faces in common planes only
touch, however deep the cubes stand in each other. A disagreement about a body being *inside* another is never excused:
no shift by tau gives the other answer. Neither are candidates of volumes, nor verdicts on intervals.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Final

import numpy as np

from cdcore import Detection, Motion, Verdict
from cdcore.narrow.pair_frames import rows_of_columns
from cdcore.numerics import BoolArray, IntArray
from cdcore.protocol import is_one_of
from cdcore.tolerances import TWO_MICROMETRES
from replay.auditing.compare import ToleranceCheck, compare
from replay.auditing.episodes import episodes
from replay.auditing.holding import holdings
from replay.auditing.outcome import Comparison, Episode
from replay.errors import AuditError
from replay.prepare.assembly import Assembly
from sessions import Session

if TYPE_CHECKING:
    from cdcore.narrow.ill_posed import MarginStage

FRAMES_AT_ONCE: Final = 1024
"""Frames whose faces are held together: some 25 MB when every pair of a bench meets in a thousand face pairs."""

EXCUSABLE_VERDICTS: Final = (Verdict.CLEAR, Verdict.CONTACT, Verdict.NOT_FOUND)
"""Verdicts about surfaces."""


class Tolerance:
    """Judges the disagreements of one run; each pair-frame is measured once, whoever disagrees there.

    ``faces`` gives an exact detector's verdicts and faces for some frames. ``tau`` is in metres; with 0 nothing is
    excused, not even a touch. Raises ``AuditError``: it is negative or not finite.
    """

    def __init__(self, assembly: Assembly, faces: Callable[[Motion], Detection], tau: float = TWO_MICROMETRES) -> None:
        if not 0.0 <= tau < float("inf"):
            raise AuditError(f"tau {tau} is no tolerance; give metres, 0 or more")
        self._assembly, self._faces, self._tau = assembly, faces, tau
        # (T, P): 0 not measured, 1 beyond tau, 2 within.
        self._measured = np.zeros((len(assembly.motion), len(assembly.pairs)), dtype=np.uint8)

    @cached_property
    def _stage(self) -> "MarginStage":
        """The geometry behind a judgement, with its compiler: a run without a disagreement loads neither."""
        from cdcore.narrow.ill_posed import MarginStage

        return MarginStage(self._assembly.bodies, self._tau)

    def judge(self, subject: Detection, oracle: Detection) -> ToleranceCheck:
        """Return a function from K disagreeing pair-frames (frames, columns) to those within tolerance, (K,)."""

        def within(frames: IntArray, columns: IntArray) -> BoolArray:
            is_excusable = is_one_of(subject.verdict[frames, columns], EXCUSABLE_VERDICTS)
            is_excusable &= is_one_of(oracle.verdict[frames, columns], EXCUSABLE_VERDICTS)
            is_excusable &= self._tau > 0 and subject.covers == oracle.covers == "instants"
            frames, columns = frames[is_excusable], columns[is_excusable]
            is_unmeasured = self._measured[frames, columns] == 0
            self._measured[frames[is_unmeasured], columns[is_unmeasured]] = 1 + self._are_within(
                frames[is_unmeasured], columns[is_unmeasured]
            )
            is_excusable[is_excusable] = self._measured[frames, columns] == 2
            return is_excusable

        return within

    def _are_within(self, frames: IntArray, columns: IntArray) -> BoolArray:
        is_within = np.zeros(len(frames), dtype=np.bool_)
        frame_numbers, row_of_frame = np.unique(frames, return_inverse=True)
        for start in range(0, len(frame_numbers), FRAMES_AT_ONCE):
            block_rows = np.flatnonzero((row_of_frame >= start) & (row_of_frame < start + FRAMES_AT_ONCE))
            motion = self._assembly.motion.take(frame_numbers[start : start + FRAMES_AT_ONCE])
            is_within[block_rows] = self._judge(motion, row_of_frame[block_rows] - start, columns[block_rows])
        return is_within

    def _judge(self, motion: Motion, frame_rows: IntArray, columns: IntArray) -> BoolArray:
        """Return which pair-frames of a short motion are within tolerance."""
        exact_detection = self._faces(motion)
        surfaces_meet = exact_detection.verdict[frame_rows, columns] == Verdict.CONTACT
        is_within = np.zeros(len(frame_rows), dtype=np.bool_)
        for column, column_rows in rows_of_columns(columns):
            bodies = self._assembly.pairs[column]
            pair = int(bodies[0]), int(bodies[1])
            separated_rows = column_rows[~surfaces_meet[column_rows]]
            if len(separated_rows):
                poses = frame_rows[separated_rows][:, None], bodies
                is_within[separated_rows] = self._stage.near(pair, motion.rotations[poses], motion.translations[poses])
            measured_depths: dict[tuple[bytes, bytes], bool] = {}
            for entry in column_rows[surfaces_meet[column_rows]]:
                rotation_pair, translation_pair = (
                    motion.rotations[frame_rows[entry], bodies],
                    motion.translations[frame_rows[entry], bodies],
                )
                key = rotation_pair.tobytes(), translation_pair.tobytes()
                if key not in measured_depths:
                    depth_arguments = (
                        pair,
                        exact_detection.faces(int(frame_rows[entry]), column),
                        rotation_pair,
                        translation_pair,
                    )
                    measured_depths[key] = self._stage.shallow(*depth_arguments) and self._stage.loose(*depth_arguments)
                is_within[entry] = measured_depths[key]
        return is_within


@dataclass(frozen=True, eq=False)
class Reference:
    """Answers of the oracle, its contacts, the times in which a hand holds a body, and the tolerance."""

    detection: Detection
    episodes: tuple[Episode, ...]
    holdings: tuple[Episode, ...]
    tolerance: Tolerance
    contact_columns: IntArray | None = None

    @classmethod
    def of(cls, detection: Detection, assembly: Assembly, session: Session | None, tolerance: Tolerance) -> "Reference":
        """The reference of a detection of an assembly; hands are those of the ``session``."""
        columns = assembly.contact_columns
        contacts = episodes(detection, assembly.motion.valid, columns)
        return cls(detection, contacts, holdings(assembly, session, contacts), tolerance, columns)

    @cached_property
    def contacts(self) -> tuple[Episode, ...]:
        """The contacts that count: all but those of a hand with what it holds."""
        holdings_set = set(self.holdings)
        return tuple(contact for contact in self.episodes if contact not in holdings_set)

    def compare(self, subject: Detection, labels: tuple[str, str] | None = None) -> Comparison:
        """Hold a detection to it; ``labels`` as for ``compare``."""
        within = self.tolerance.judge(subject, self.detection)
        comparison = compare(subject, self.detection, labels, within, self.holdings)
        return replace(comparison, contact_columns=self.contact_columns)
