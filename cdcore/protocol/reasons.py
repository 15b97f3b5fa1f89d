"""Why verdicts are undecided: every UNRESOLVED and INVALID of a detection has a reason."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from cdcore.numerics import ByteArray
from cdcore.protocol.verdict import Verdict, is_one_of

DECIDED: Final = "decided"
"""Word in ``Detection.containment`` for a pair whose containment was decided in every frame."""

PARTLY_DECIDED: Final = "partly: "
"""Begins the word of a pair whose containment may be UNRESOLVED in some frames; the reason follows."""

REFUSED: Final = "refused: "
"""Begins the word of a pair whose containment is never decided; the reason follows."""

INSIDE_UNDECIDED: Final = "inside undecided: "
"""Begins the reason of a pair-frame that is UNRESOLVED because a mesh does not tell its inside."""

NO_REASON: Final = "the detector gives no reason"

PairFrame = tuple[int, int]


class Reasons(Mapping[PairFrame, str]):
    """Reasons by (frame, pair): those that the detector noted, else the one it gives for the containment of the pair.

    Few are noted one by one: a hole leaves a pair undecided for minutes.

    Parameters
    ----------
    noted : reasons of single places, whatever their verdict.
    verdict : (T, P) uint8.
    containment : (P,) as in ``Detection``, or none.
    """

    def __init__(self, noted: Mapping[PairFrame, str], verdict: ByteArray, containment: Sequence[str]) -> None:
        self.noted: Mapping[PairFrame, str] = noted.noted if isinstance(noted, Reasons) else noted
        self._verdict, self._containment = verdict, containment

    def __getitem__(self, pair_frame: PairFrame) -> str:
        if pair_frame in self.noted:
            return self.noted[pair_frame]
        frame, pair = pair_frame
        frames, pairs = self._verdict.shape
        if 0 <= frame < frames and 0 <= pair < pairs:
            verdict = self._verdict[frame, pair]
            if verdict == Verdict.UNRESOLVED:
                return self._of_pair(pair, PARTLY_DECIDED)
            if verdict == Verdict.INVALID:
                return self._of_pair(pair, REFUSED)
        raise KeyError(pair_frame)

    def __iter__(self) -> Iterator[PairFrame]:
        yield from self.noted
        for frame, pair in self._undecided():
            if (frame, pair) not in self.noted:
                yield frame, pair

    def __len__(self) -> int:
        return len(self.noted) + sum((frame, pair) not in self.noted for frame, pair in self._undecided())

    def __repr__(self) -> str:
        return f"Reasons({len(self.noted)} noted, {len(self)} in all)"

    def _undecided(self) -> list[list[int]]:
        """Frames and pairs that need a reason."""
        pair_frames: list[list[int]] = np.argwhere(
            is_one_of(self._verdict, (Verdict.UNRESOLVED, Verdict.INVALID))
        ).tolist()
        return pair_frames

    def _of_pair(self, pair: int, beginning: str) -> str:
        """The reason after the beginning of what is said of the containment of a pair."""
        text = self._containment[pair] if pair < len(self._containment) else ""
        return text.removeprefix(beginning) if text.startswith(beginning) else NO_REASON
