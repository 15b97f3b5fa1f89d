"""The answer of a detector: a verdict for every frame and pair, the work and the time, on request the faces."""

from __future__ import annotations

import hashlib
from bisect import bisect
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from html import escape
from itertools import accumulate
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from cdcore.errors import NotRecordedError
from cdcore.numerics import ByteArray, FloatArray, IntArray, readonly
from cdcore.protocol.face_sets import FaceSets
from cdcore.protocol.reasons import Reasons
from cdcore.protocol.verdict import Verdict, counts_as_contact

Covers = Literal["instants", "intervals"]
SectionSource = Callable[[int, int, IntArray], FloatArray]
"""``(frame, pair, faces) -> (k, 2, 3)``: computes intersection segments on request."""

MOST_PAIRS = 20
"""Pairs that a notebook lists of a detection."""


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
    toi : {(frame, pair): (low, high)} seconds, interval of the time of impact where ``covers`` is intervals.
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
        readonly(self.verdict)
        object.__setattr__(self, "reasons", Reasons(self.reasons, self.verdict, self.containment))

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
            self, times=self.times[frames], verdict=self.verdict[frames], work={}, seconds={}, section_source=None,
            face_sets=None if self.face_sets is None else self.face_sets.take(frames),
            reasons={(row[t], p): why for (t, p), why in _noted(self).items() if t in row},
            toi={(row[t], p): toi for (t, p), toi in self.toi.items() if t in row},
        )  # fmt: skip

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
    parts = list(detections)
    if not parts:
        raise ValueError("there is no block to join; stream at least one motion")
    head = parts[0]
    first = [0, *accumulate(len(part.times) for part in parts)]
    blocks = list(zip(first, parts, strict=False))
    sources = [part.section_source for part in parts]
    faces = None
    if all(part.face_sets is not None for part in parts):
        faces = FaceSets.join((start, part.face_sets) for start, part in blocks if part.face_sets)
    return replace(
        head,
        times=np.concatenate([part.times for part in parts]),
        verdict=np.concatenate([part.verdict for part in parts]),
        face_sets=faces,
        work=_added([part.work for part in parts]),
        seconds=_added([part.seconds for part in parts]),
        reasons={(t + start, p): why for start, part in blocks for (t, p), why in _noted(part).items()},
        toi={(t + start, p): toi for start, part in blocks for (t, p), toi in part.toi.items()},
        section_source=None if None in sources else partial(_section_in_block, sources, first),
    )


def _noted(detection: Detection) -> Mapping[tuple[int, int], str]:
    """The reasons that a detector noted one by one."""
    return Reasons(detection.reasons, detection.verdict, ()).noted


def _section_in_block(sources: list[Any], first: list[int], frame: int, pair: int, faces: IntArray) -> FloatArray:
    """The segments of a frame, of the block in which it lies."""
    block = bisect(first, frame) - 1
    segments: FloatArray = sources[block](frame - first[block], pair, faces)
    return segments


def _added(tables: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Totals are added, arrays over frames put after each other."""
    total: dict[str, Any] = {}
    for name in dict.fromkeys(key for table in tables for key in table):
        values = [table[name] for table in tables if name in table]
        arrays = all(isinstance(value, np.ndarray) for value in values)
        total[name] = np.concatenate(values) if arrays else sum(values)
    return total
