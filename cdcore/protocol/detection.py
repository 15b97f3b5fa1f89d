"""The answer of a detector: a verdict for every frame and pair, the work and the time, on request the faces."""

from __future__ import annotations

import hashlib
from bisect import bisect
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from html import escape
from itertools import accumulate
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from cdcore.errors import NotRecordedError
from cdcore.numerics import ByteArray, FloatArray, Int32Array, IntArray, readonly
from cdcore.protocol.verdict import Verdict, counts_as_contact, is_one_of

Covers = Literal["instants", "intervals"]
SectionSource = Callable[[int, int, IntArray], FloatArray]
"""``(frame, pair, faces) -> (k, 2, 3)``: computes intersection segments on request."""

MOST_PAIRS = 20
"""Pairs that a notebook lists of a detection."""

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

NO_FACES: Int32Array = readonly(np.zeros((0, 2), dtype=np.int32))


@dataclass(frozen=True, eq=False)
class FaceSets:
    """Faces that meet, for every frame and pair in contact.

    Entry k says that in frame ``frame[k]`` pair ``pair[k]`` (a column of the detection) meets in
    ``faces[start[k]:stop[k]]``; entries are sorted by frame, then pair. Equal sets of neighbouring frames may share
    rows of ``faces`` (run-length storage), which is what keeps hours of resting contact small.

    Parameters
    ----------
    frame, pair, start, stop : (K,) int64.
    faces : (M, 2) int32, (face of the pair's first body, face of its second), each set unique and sorted.
    """

    frame: IntArray
    pair: IntArray
    start: IntArray
    stop: IntArray
    faces: Int32Array

    def __post_init__(self) -> None:
        for array in (self.frame, self.pair, self.start, self.stop, self.faces):
            readonly(array)

    @classmethod
    def from_shared(
        cls,
        frame: NDArray[np.integer],
        pair: NDArray[np.integer],
        which: NDArray[np.integer],
        sets: Sequence[NDArray[np.integer]],
    ) -> FaceSets:
        """Build from distinct sets and, for each entry, which of them it is; entries without a face are left out.

        Entries may come in any order; each set is sorted and unique.
        """
        sizes = np.array([len(rows_of_set) for rows_of_set in sets], dtype=np.int64)
        stop = np.cumsum(sizes)
        keep = np.flatnonzero(sizes[which])
        order = keep[np.lexsort((pair[keep], frame[keep]))]
        rows = [np.asarray(rows_of_set, dtype=np.int32).reshape(-1, 2) for rows_of_set in sets]
        faces = np.concatenate([NO_FACES, *rows])
        number = which[order].astype(np.int64)
        start = (stop - sizes)[number]
        return cls(frame[order].astype(np.int64), pair[order].astype(np.int64), start, stop[number], faces)

    def at(self, frame: int, pair: int) -> IntArray:
        """The face pairs of one frame and pair, (k, 2) int64; k = 0 where there is no contact."""
        lower, upper = np.searchsorted(self.frame, [frame, frame + 1])
        entry = lower + int(np.searchsorted(self.pair[lower:upper], pair))
        if entry >= upper or self.pair[entry] != pair:
            return np.zeros((0, 2), dtype=np.int64)
        return self.faces[self.start[entry] : self.stop[entry]].astype(np.int64)

    def counts(self, frames: int, pairs: int) -> IntArray:
        """Number of face pairs for every frame and pair, (T, P)."""
        counts = np.zeros((frames, pairs), dtype=np.int64)
        counts[self.frame, self.pair] = self.stop - self.start
        return counts

    def take(self, frames: IntArray) -> FaceSets:
        """Those of some frames (n,), increasing, numbered from 0; the rows of ``faces`` are shared."""
        lower, upper = (np.searchsorted(self.frame, frames, side) for side in ("left", "right"))
        sizes = upper - lower
        kept = np.arange(sizes.sum()) + np.repeat(lower - (np.cumsum(sizes) - sizes), sizes)
        numbers = np.repeat(np.arange(len(frames)), sizes)
        return FaceSets(numbers, self.pair[kept], self.start[kept], self.stop[kept], self.faces)

    @classmethod
    def join(cls, numbered_blocks: Iterable[tuple[int, FaceSets]]) -> FaceSets:
        """Put blocks after each other; each comes with the number of its first frame."""
        blocks = list(numbered_blocks)
        rows = np.cumsum([0] + [len(sets.faces) for _, sets in blocks])
        return cls(
            np.concatenate([sets.frame + first for first, sets in blocks]),
            np.concatenate([sets.pair for _, sets in blocks]),
            np.concatenate([sets.start + row for (_, sets), row in zip(blocks, rows, strict=False)]),
            np.concatenate([sets.stop + row for (_, sets), row in zip(blocks, rows, strict=False)]),
            np.concatenate([sets.faces for _, sets in blocks]),
        )


@dataclass(frozen=True, eq=False, repr=False)
class Reasons(Mapping[PairFrame, str]):
    """Reasons by (frame, pair): those that the detector noted, else the one it gives for the containment of the pair.

    Few are noted one by one: a hole leaves a pair undecided for minutes.

    Parameters
    ----------
    noted : reasons of single places, whatever their verdict.
    verdict : (T, P) uint8.
    containment : (P,) as in ``Detection``, or none.
    """

    noted: Mapping[PairFrame, str]
    verdict: ByteArray
    containment: Sequence[str]

    def __getitem__(self, pair_frame: PairFrame) -> str:
        if pair_frame in self.noted:
            return self.noted[pair_frame]
        frame, pair = pair_frame
        frames, pairs = self.verdict.shape
        if 0 <= frame < frames and 0 <= pair < pairs:
            verdict = self.verdict[frame, pair]
            if verdict == Verdict.UNRESOLVED:
                return self._of_pair(pair, PARTLY_DECIDED)
            if verdict == Verdict.INVALID:
                return self._of_pair(pair, REFUSED)
        raise KeyError(pair_frame)

    def __iter__(self) -> Iterator[PairFrame]:
        yield from self.noted
        for frame, pair in self._undecided_pair_frames():
            if (frame, pair) not in self.noted:
                yield frame, pair

    def __len__(self) -> int:
        return len(self.noted) + sum((frame, pair) not in self.noted for frame, pair in self._undecided_pair_frames())

    def __repr__(self) -> str:
        return f"Reasons({len(self.noted)} noted, {len(self)} in all)"

    def _undecided_pair_frames(self) -> list[list[int]]:
        """Frames and pairs that need a reason."""
        pair_frames: list[list[int]] = np.argwhere(
            is_one_of(self.verdict, (Verdict.UNRESOLVED, Verdict.INVALID))
        ).tolist()
        return pair_frames

    def _of_pair(self, pair: int, beginning: str) -> str:
        """The reason after the beginning of what is said of the containment of a pair."""
        text = self.containment[pair] if pair < len(self.containment) else ""
        return text.removeprefix(beginning) if text.startswith(beginning) else NO_REASON


@dataclass(frozen=True, eq=False)
class Detection:
    """The answer of one detector for T frames and P pairs.

    Parameters
    ----------
    detector : the detector's name.
    names : names of all N bodies.
    pairs : (P, 2) int64 body numbers.
    times : (T,) seconds.
    verdict : (T, P) uint8, values of ``Verdict``.
    covers : ``"instants"``: row t speaks of the pose at frame t; ``"intervals"``: of the closed interval from t-1 to t.
    face_sets : the faces that meet, or ``None`` when they were not asked for.
    containment : (P,) words: ``"decided"``, ``"partly: <reason>"`` or ``"refused: <reason>"``.
    work : counters: a total, or (T, P) uint32 where asked for.
    seconds : time per stage: (T,) where frames are timed one by one, else one number for the call.
    approximate : whether the answer is an estimate by nature (``image-space``).
    reasons : why (frame, pair) is UNRESOLVED or INVALID; a detector notes what ``containment`` does not say already.
    toi : {(frame, pair): (lower, upper)} seconds, interval of the time of impact where ``covers`` is intervals.
    """

    detector: str
    names: tuple[str, ...]
    pairs: IntArray
    times: FloatArray
    verdict: ByteArray
    covers: Covers = "instants"
    face_sets: FaceSets | None = None
    containment: tuple[str, ...] = ()
    work: Mapping[str, int | NDArray[np.uint32]] = field(default_factory=dict)
    seconds: Mapping[str, float | FloatArray] = field(default_factory=dict)
    approximate: bool = False
    reasons: Mapping[tuple[int, int], str] = field(default_factory=dict)
    toi: Mapping[tuple[int, int], tuple[float, float]] = field(default_factory=dict)
    section_source: SectionSource | None = None

    def __post_init__(self) -> None:
        self.verdict.setflags(write=False)
        noted = self.reasons.noted if isinstance(self.reasons, Reasons) else self.reasons
        object.__setattr__(self, "reasons", Reasons(noted, self.verdict, self.containment))

    def __repr__(self) -> str:
        frames, pairs = self.verdict.shape
        counts = np.bincount(self.verdict.ravel(), minlength=len(Verdict)).tolist()
        labels = ", ".join(f"{count:,} {word.name}" for word, count in zip(Verdict, counts, strict=True) if count)
        return (
            f"Detection({self.detector}: {frames} frames, {pairs} pairs, covers {self.covers}: {labels or 'nothing'})"
        )

    def _repr_html_(self) -> str:
        """A table for a notebook: how many frames of each pair got which verdict, most contact first."""
        labels = [word for word in Verdict if (self.verdict == word).any()]
        order = np.argsort(-counts_as_contact(self.verdict).sum(axis=0), kind="stable")
        head = "".join(f"<th>{word.name}</th>" for word in labels)
        rows = ""
        for pair in order[:MOST_PAIRS].tolist():
            a, b = self.pairs[pair].tolist()
            cells = "".join(f"<td>{np.count_nonzero(self.verdict[:, pair] == word):,}</td>" for word in labels)
            rows += f"<tr><th>{escape(f'{self.names[a]}-{self.names[b]}')}</th>{cells}</tr>"
        rest = f"<p>and {len(order) - MOST_PAIRS} more pairs</p>" if len(order) > MOST_PAIRS else ""
        return f"<p>{escape(repr(self))}</p><table><tr><th>frames</th>{head}</tr>{rows}</table>{rest}"

    @property
    def noted_reasons(self) -> Mapping[PairFrame, str]:
        """The reasons that the detector noted one by one."""
        assert isinstance(self.reasons, Reasons), "set when the detection is made"
        return self.reasons.noted

    @property
    def face_counts(self) -> IntArray:
        """Number of face pairs, (T, P) int64.

        Raises
        ------
        NotRecordedError
            The detector was not asked for faces.
        """
        return self._requested_faces().counts(*self.verdict.shape)

    def faces(self, frame: int, pair: int) -> IntArray:
        """Face pairs of one frame and pair (column), (k, 2) int64, unique and sorted; k = 0 without contact."""
        return self._requested_faces().at(*self._checked_index(frame, pair))

    def section(self, frame: int, pair: int) -> FloatArray:
        """Intersection segments of the faces that meet, (k, 2, 3) world metres; degenerate ones have equal ends.

        Fewer than the face pairs only where a rounding engine listed pairs that, taken exactly, do not meet.
        """
        faces = self.faces(frame, pair)
        if self.section_source is None:
            raise NotRecordedError(f"{self.detector} computes no intersection segments; use a detector on meshes")
        return self.section_source(*self._checked_index(frame, pair), faces)

    def take(self, frames: IntArray) -> Detection:
        """Returns the answer for some frames (n,), increasing; without work, seconds and segments."""
        row = {frame: k for k, frame in enumerate(frames.tolist())}
        return replace(
            self,
            times=self.times[frames],
            verdict=self.verdict[frames],
            work={},
            seconds={},
            section_source=None,
            face_sets=None if self.face_sets is None else self.face_sets.take(frames),
            reasons={(row[t], p): why for (t, p), why in self.noted_reasons.items() if t in row},
            toi={(row[t], p): toi for (t, p), toi in self.toi.items() if t in row},
        )

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the verdicts, sorted by stamp and body names."""
        digest, order = self._begin_digest("verdicts/1")
        stamps = self.times.astype("<f8").view(np.uint8).reshape(-1, 8)
        for start in range(0, len(stamps), 65536):
            rows = slice(start, start + 65536)
            digest.update(np.hstack([stamps[rows], self.verdict[rows][:, order]]).tobytes())
        return digest.hexdigest()

    @cached_property
    def faces_digest(self) -> str:
        """SHA-256 of all face pairs, sorted by stamp, body names and faces."""
        sets = self._requested_faces()
        digest, order = self._begin_digest("faces/1")
        rank = np.argsort(order)
        swapped = [self.names[i] > self.names[j] for i, j in self.pairs.tolist()]
        for entry in np.lexsort((rank[sets.pair], sets.frame)).tolist():
            column = sets.pair[entry]
            faces = sets.faces[sets.start[entry] : sets.stop[entry]]
            if swapped[column]:
                faces = faces[np.lexsort(faces.T), ::-1]
            head = np.array([rank[column], len(faces)], dtype="<i8")
            stamp = self.times[sets.frame[entry]].astype("<f8")
            digest.update(stamp.tobytes() + head.tobytes() + faces.astype("<i4").tobytes())
        return digest.hexdigest()

    def _begin_digest(self, kind: str) -> tuple[hashlib._Hash, list[int]]:
        """A digest of the names of all pairs, and the columns in the order of these names."""
        names = [sorted(self.names[k] for k in pair) for pair in self.pairs.tolist()]
        order = sorted(range(len(names)), key=names.__getitem__)
        labels = [kind, self.covers, *("\x1f".join(names[column]) for column in order)]
        return hashlib.sha256("\x1e".join(labels).encode()), order

    def _requested_faces(self) -> FaceSets:
        if self.face_sets is None:
            raise NotRecordedError(
                f"this result of {self.detector!r} holds no face pairs; "
                "call detect(motion, faces=True) of a detector that works on meshes"
            )
        return self.face_sets

    def _checked_index(self, frame: int, pair: int) -> tuple[int, int]:
        frames, pairs = self.verdict.shape
        if not (-frames <= frame < frames and -pairs <= pair < pairs):
            raise IndexError(f"no frame {frame} and pair {pair}; there are {frames} frames and {pairs} pairs")
        return frame % frames, pair % pairs


def join(detections: Iterable[Detection]) -> Detection:
    """Put the blocks of a stream together: the result equals ``detect`` on the whole motion.

    Raises
    ------
    ValueError
        There is no block.
    """
    answers = list(detections)
    if not answers:
        raise ValueError("there is no block to join; stream at least one motion")
    head = answers[0]
    first = [0, *accumulate(len(answer.times) for answer in answers)]
    blocks = list(zip(first, answers, strict=False))
    sources = [answer.section_source for answer in answers]
    faces = None
    if all(answer.face_sets is not None for answer in answers):
        faces = FaceSets.join((start, answer.face_sets) for start, answer in blocks if answer.face_sets)
    return replace(
        head,
        times=np.concatenate([answer.times for answer in answers]),
        verdict=np.concatenate([answer.verdict for answer in answers]),
        face_sets=faces,
        work=_added_totals([answer.work for answer in answers]),
        seconds=_added_totals([answer.seconds for answer in answers]),
        reasons={(t + start, p): why for start, answer in blocks for (t, p), why in answer.noted_reasons.items()},
        toi={(t + start, p): toi for start, answer in blocks for (t, p), toi in answer.toi.items()},
        section_source=None if None in sources else partial(_section_in_block, sources, first),
    )


def _section_in_block(sources: list[Any], first: list[int], frame: int, pair: int, faces: IntArray) -> FloatArray:
    """The segments of a frame, of the block in which it lies."""
    block = bisect(first, frame) - 1
    segments: FloatArray = sources[block](frame - first[block], pair, faces)
    return segments


def _added_totals(tables: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Totals are added, arrays over frames put after each other."""
    total: dict[str, Any] = {}
    for name in dict.fromkeys(key for table in tables for key in table):
        values = [table[name] for table in tables if name in table]
        arrays = all(isinstance(value, np.ndarray) for value in values)
        total[name] = np.concatenate(values) if arrays else sum(values)
    return total
