"""A motion is the poses of all bodies at all times: finite and rigid wherever it says a pose is valid."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from types import ModuleType
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from cdcore.errors import InvalidPoseError
from cdcore.numerics import BoolArray, FloatArray, IntArray, readonly
from cdcore.poses import rotation_from_quaternion
from cdcore.tolerances import QUATERNION_REJECT

NO_MATRICES: Final = np.empty((0, 0, 4, 4))


@dataclass(frozen=True, eq=False, init=False)
class Motion:
    """Poses of N bodies at T times, body to world, column convention.

    Rotations within rounding of orthonormal keep their bits; up to 1e-3 off they are projected to the nearest rotation
    (``renormalised`` counts them and ``worst_orthonormality`` keeps the largest error); beyond that they are refused.

    Parameters
    ----------
    times : (T,) seconds, strictly increasing.
    translations : (T, N, 3) metres.
    rotations : (T, N, 3, 3).
    valid : (T, N) bool; rows that are False are not read. ``None``: all valid.
    linked : (T, N) bool; whether the path from the frame before is known (False after a gap or a teleport), which
        detectors of intervals ask. ``None``: known wherever both ends are valid.
    names : N body names, used in messages.
    copy : False: float64 arrays are kept as they are, made read-only and, where a rotation needs it, repaired in place.

    Raises
    ------
    InvalidPoseError
        Names frame and body: not finite, not a rotation, a reflection; or times that do not increase.
    """

    times: FloatArray
    translations: FloatArray
    rotations: FloatArray
    valid: BoolArray
    linked: BoolArray
    renormalised: int
    worst_orthonormality: float

    def __init__(
        self,
        times: ArrayLike,
        translations: ArrayLike,
        rotations: ArrayLike,
        valid: ArrayLike | None = None,
        *,
        linked: ArrayLike | None = None,
        names: Sequence[str] | None = None,
        copy: bool = True,
    ) -> None:
        clock = _times(times)
        position = _array(translations, "translations", (len(clock), None, 3), copy=copy)
        rotation = _array(rotations, "rotations", (len(clock), position.shape[1], 3, 3), copy=copy)
        mask = _mask(valid, position.shape[:2], "valid")
        self._keep_unless_corrupt(clock, NO_MATRICES, position, rotation, mask, linked, names)

    def _keep_unless_corrupt(
        self,
        clock: FloatArray,
        matrices: FloatArray,
        position: FloatArray,
        rotation: FloatArray,
        mask: BoolArray,
        linked: ArrayLike | None,
        names: Sequence[str] | None,
    ) -> None:
        """Keep arrays of our own, filled from matrices if there are any; a corrupt pose is refused."""
        label = partial(_frame_and_body, mask=mask, clock=clock, names=names)
        changed, repaired, worst = _compiled().refuse_corrupt_poses(matrices, position, rotation, mask, label)
        self._keep(clock, position, rotation, mask, _known(mask, linked), repaired, worst)
        self.__dict__["changed"] = readonly(changed)

    def _keep(self, *values: object) -> None:
        for field, value in zip(self.__dataclass_fields__, values, strict=True):
            self.__dict__[field] = readonly(value) if isinstance(value, np.ndarray) else value

    @classmethod
    def of_rigid(
        cls, times: FloatArray, translations: FloatArray, rotations: FloatArray, valid: BoolArray, linked: BoolArray
    ) -> Motion:
        """A motion of poses that are known to be finite and rigid: kept as they are, and no compiler is loaded.

        Choose it where poses were checked sample by sample and only effects will read them, or are products of those of
        a motion; else a detector's motion is made by the constructor, which checks.
        """
        motion = object.__new__(cls)
        motion._keep(_times(times), translations, rotations, valid, linked & valid, 0, 0.0)
        return motion

    @classmethod
    def from_quaternions(
        cls,
        times: ArrayLike,
        translations: ArrayLike,
        quaternions_xyzw: ArrayLike,
        valid: ArrayLike | None = None,
        *,
        linked: ArrayLike | None = None,
        names: Sequence[str] | None = None,
    ) -> Motion:
        """Build a motion from unit quaternions (T, N, 4), xyzw; norms up to 1e-3 off 1 are renormalised in float64.

        Raises
        ------
        InvalidPoseError
            A quaternion that is zero, not finite or further off; names frame and body.
        """
        clock = _times(times)
        q = _array(quaternions_xyzw, "quaternions_xyzw", (len(clock), None, 4))
        mask = _mask(valid, q.shape[:2], "valid")
        q[~mask] = 0.0, 0.0, 0.0, 1.0
        with np.errstate(over="ignore"):
            off = ~(np.abs(np.linalg.norm(q, axis=2) - 1.0) <= QUATERNION_REJECT)
        if off.any():
            bad = int(off.argmax())
            given = q.reshape(-1, 4)[bad].tolist()
            what = f"quaternion {given} has norm {math.hypot(*given):.6g}, not 1"
            what += "; flag the pose as not valid or repair it"
            raise InvalidPoseError(_frame_and_body(bad, mask, clock, names) + what)
        position = _array(translations, "translations", (len(clock), mask.shape[1], 3))
        return cls(clock, position, rotation_from_quaternion(q), mask, linked=linked, names=names)

    @classmethod
    def from_matrices(
        cls,
        times: ArrayLike,
        poses: ArrayLike,
        valid: ArrayLike | None = None,
        *,
        linked: ArrayLike | None = None,
        names: Sequence[str] | None = None,
    ) -> Motion:
        """Build a motion from 4x4 matrices (T, N, 4, 4), column convention: the last row is 0 0 0 1."""
        clock = _times(times)
        matrices = _array(poses, "poses", (len(clock), None, 4, 4), copy=False)
        mask = _mask(valid, matrices.shape[:2], "valid")
        position, rotation = np.empty((*mask.shape, 3)), np.empty((*mask.shape, 3, 3))
        motion = object.__new__(cls)
        motion._keep_unless_corrupt(clock, matrices, position, rotation, mask, linked, names)
        return motion

    def __len__(self) -> int:
        return len(self.times)

    @cached_property
    def changed(self) -> BoolArray:
        """(T, N): whether a body is at another pose than in the row before, and True in row 0 of a whole motion.

        A body without a pose is thought to stay where it was, or to wait where it will be first.
        """
        # Of a motion that was checked the pass that did it has filled this in.
        compiled, changed = _compiled(), np.empty(self.valid.shape, dtype=np.bool_)
        rotation, position = (np.ascontiguousarray(array) for array in (self.rotations, self.translations))
        last = np.full(self.valid.shape[1], compiled.GOOD)
        compiled.note_changes(readonly(position[:]), readonly(rotation[:]), self.valid, last, changed)
        return readonly(changed)

    def frames(self, start: int, stop: int) -> Motion:
        """The frames ``start <= t < stop`` as a motion; nothing is checked or rounded again."""
        rows = slice(start, stop)
        selection = self._selection(rows, self.linked[rows])
        # A live engine takes one frame after the other, and asks none of them.
        if stop - start > 1 and "changed" in self.__dict__:
            selection.__dict__["changed"] = self.changed[rows]
        return selection

    def take(self, frames: IntArray) -> Motion:
        """The frames of these numbers, increasing, as a motion; paths across left-out frames are not linked."""
        linked = self.linked[frames].copy()
        linked[1:][np.diff(frames) != 1] = False
        selection = self._selection(frames, linked)
        for name in ("times", "translations", "rotations", "valid", "linked"):
            readonly(selection.__dict__[name])
        return selection

    def _selection(self, rows: slice | IntArray, linked: BoolArray) -> Motion:
        selection = object.__new__(Motion)
        selection.__dict__.update(
            times=self.times[rows],
            translations=self.translations[rows],
            rotations=self.rotations[rows],
            valid=self.valid[rows],
            linked=linked,
            renormalised=self.renormalised,
            worst_orthonormality=self.worst_orthonormality,
        )
        return selection

    def blocks(self, frames: int) -> Iterator[Motion]:
        """The motion in consecutive blocks of at most this many frames."""
        for start in range(0, len(self), frames):
            yield self.frames(start, min(start + frames, len(self)))


def pair_has_pose(motion: Motion, pairs: IntArray) -> BoolArray:
    """Whether both bodies of a pair have a pose, (T, P)."""
    return motion.valid[:, pairs[:, 0]] & motion.valid[:, pairs[:, 1]]


def blocks_in_order(motions: Iterable[Motion]) -> Iterator[Motion]:
    """The blocks of a stream; InvalidPoseError where one starts before the end of the block before it."""
    last: float | None = None
    for number, motion in enumerate(motions):
        if len(motion):
            first = float(motion.times[0])
            if last is not None and not first > last:
                raise InvalidPoseError(
                    f"block {number} starts at {first!r} s, not after {last!r} s where the block before ends; "
                    "stream the blocks in order of time"
                )
            last = float(motion.times[-1])
        yield motion


def _known(mask: BoolArray, linked: ArrayLike | None) -> BoolArray:
    """Whether the path from the frame before is known, (T, N)."""
    known = mask.copy() if linked is None else _mask(linked, mask.shape, "linked") & mask
    known[1:] &= mask[:-1]
    known[:1] = False
    return known


def _compiled() -> ModuleType:
    """The compiled passes, imported with the first motion: the compiler takes half a second to load."""
    from cdcore.poses import corrupt_poses

    return corrupt_poses


def _times(times: ArrayLike) -> FloatArray:
    clock = np.array(times, dtype=np.float64)
    if clock.ndim != 1:
        raise InvalidPoseError(f"times have shape {clock.shape}; give (T,) seconds")
    # times that increase are finite between two that are
    if (clock[1:] > clock[:-1]).all() and np.isfinite(clock[:1]).all() and np.isfinite(clock[-1:]).all():
        return clock
    if not np.isfinite(clock).all():
        frame = int(np.flatnonzero(~np.isfinite(clock))[0])
        raise InvalidPoseError(f"frame {frame}: time {clock[frame]} is not finite; drop the frame")
    frame = int(np.flatnonzero(clock[1:] <= clock[:-1])[0]) + 1
    raise InvalidPoseError(
        f"frame {frame}: time {clock[frame]!r} s does not come after {clock[frame - 1]!r} s; "
        "sort the frames and drop repeats"
    )


def _array(values: ArrayLike, what: str, shape: tuple[int | None, ...], *, copy: bool = True) -> FloatArray:
    try:
        array = np.array(values, dtype=np.float64, order="C", copy=copy or None)
    except (TypeError, ValueError) as error:
        raise InvalidPoseError(f"{what} are not an array of numbers ({error})") from None
    fits = array.ndim == len(shape) and all(want in (None, have) for want, have in zip(shape, array.shape, strict=True))
    if not fits:
        expected = ", ".join("N" if size is None else str(size) for size in shape)
        raise InvalidPoseError(f"{what} have shape {array.shape}; give ({expected})")
    return array


def _mask(mask: ArrayLike | None, shape: tuple[int, ...], what: str) -> BoolArray:
    if mask is None:
        return np.ones(shape, dtype=np.bool_)
    array = np.array(mask, dtype=np.bool_, order="C")  # in another order kernels would be compiled once more
    if array.shape != shape:
        raise InvalidPoseError(f"{what} has shape {array.shape}; give {shape}, one flag per frame and body")
    return array


def _frame_and_body(pose: int, mask: BoolArray, clock: FloatArray, names: Sequence[str] | None) -> str:
    """Frame and body of a pose that is counted through."""
    frame, body = divmod(pose, mask.shape[1])
    name = names[body] if names is not None else str(body)
    return f"frame {frame} ({clock[frame]:.6f} s), body {name}: "
