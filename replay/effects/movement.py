"""How liquid moves between vessels: one account for all that tilt, run out and run over, whoever declared them.

In every frame each vessel gives by the state of the frame before: what its tilt does not keep, no more than a weir as
wide as its opening lets over, what its stopcock lets out; then what stands above a brim runs over. What comes in turns
into what a vessel holds by running minima; only where the weir is the limit, by the frames in which it may give. Rounds
over the vessels repeat that until nothing changes. Each settles one more hand-over in a row, so that rounds are few.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from cdcore.numerics import FloatArray, IntArray
from replay.effects.declaring import Declaration
from replay.effects.fitting import HALF_WINDOW, settled_runs, velocities
from replay.effects.inputs import BodyPoses, EffectInputs
from replay.effects.models.outflow import Stream, entry_times, over_weir, places_at_height, run_out, twist
from replay.effects.output import Series
from replay.effects.spans import BoolArray
from replay.effects.vessels import ML, Vessel, vessels_of
from sessions.doctor.track_watch import undone_turns

SPILLED, UNKNOWN = -1, -2
TURN_OUTLIER = "turn-outlier"
"""The doctor's finding of a rotation that leaves and comes back faster than a hand turns."""


@dataclass(frozen=True, eq=False)
class Movement:
    """Vessel -> what it holds in every frame, millilitres (T,), and all streams between them."""

    vessels: Mapping[str, Vessel]
    volume_ml: Mapping[str, FloatArray]
    streams: tuple[Stream, ...]
    glitches: Mapping[str, IntArray]  # vessel -> frames whose tilt would pour and is none

    def changes(self, times: FloatArray, name: str) -> Series:
        """A vessel's volume wherever it changed, and at the first and the last frame."""
        frames = [one.frames for one in self.streams if name in (one.source, one.target)]
        ends = np.array([0, len(times) - 1][: len(times)], dtype=np.int64)
        rows = np.unique(np.concatenate([ends, *frames]))
        return Series(times[rows], self.volume_ml[name][rows], "mL")


def movement_of(inputs: EffectInputs) -> Movement:
    """The movement of this run, made once."""
    return inputs.shared("movement", lambda: _Bench(inputs).moved())


@dataclass(eq=False)
class _Outlet:
    """A vessel that gives: where to, from which point, and what it does not keep."""

    declared: Declaration | None = None  # of a burette
    into: tuple[str, ...] = ()
    target: IntArray = field(init=False)  # (T,) number of the vessel it enters
    point: FloatArray = field(init=False)  # (T, 3)


class _Bench:
    def __init__(self, inputs: EffectInputs) -> None:
        self.inputs, count = inputs, len(inputs)
        self.outlets = _outlets(inputs)
        names = dict.fromkeys(name for key, outlet in self.outlets.items() for name in (key, *outlet.into))
        self.vessels, self.names = vessels_of(inputs, names), list(names)
        self.poses = {name: inputs.poses(name) for name in names}
        self.held = {name: poses.held() for name, poses in self.poses.items()}
        for outlet in self.outlets.values():
            outlet.target, outlet.point = np.full(count, UNKNOWN), np.zeros((count, 3))
        self.doubtful: dict[str, BoolArray] = {}
        self.kept = {name: self._kept(name) for name, outlet in self.outlets.items() if outlet.declared is None}
        self.most = {name: self._most(name) for name in self.kept}
        self.area = {
            name: _open_area(inputs, outlet.declared) * self.held[name].valid
            for name, outlet in self.outlets.items() if outlet.declared is not None
        }  # fmt: skip

    def moved(self) -> Movement:
        count = len(self.inputs)
        coming = {name: np.zeros(count) for name in self.names}
        while True:
            given = {name: self._given(name, coming[name]) for name in self.names}
            after = {name: np.zeros(count) for name in self.names}
            for source, (leaving, _, _) in given.items():
                if source in self.outlets:
                    self._aim(source, leaving)
                    for number in set(self.outlets[source].target[leaving > 0.0].tolist()) - {SPILLED}:
                        after[self.names[number]] += np.where(self.outlets[source].target == number, leaving, 0.0)
            if all(np.array_equal(after[name], coming[name]) for name in self.names):
                break
            coming = after
        streams = [one for name in self.names for one in self._streams(name, *given[name][:2])]
        volume_ml = {name: given[name][2] for name in self.names}
        glitches = {name: self._glitches(name, volume_ml[name]) for name in self.kept}
        return Movement(self.vessels, volume_ml, tuple(streams), glitches)

    def _glitches(self, name: str, volume_ml: FloatArray) -> IntArray:
        """Frames (n,) that would pour by a tilt which the frame after them does not have."""
        rows = np.flatnonzero(self.doubtful[name])
        kept = self.vessels[name].shape.kept_ml(_down(self.poses[name], rows)) if len(rows) else np.zeros(0)
        after = self.kept[name][np.minimum(rows + 1, len(volume_ml) - 1)]
        return rows[(kept < volume_ml[rows]) & (after >= volume_ml[rows])]

    def _given(self, name: str, coming: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """What leaves by tilt or stopcock, what runs over, and what stays, each (T,), with what comes in."""
        first, brim = self.vessels[name].volume_ml, self.vessels[name].brim_ml
        came = np.cumsum(coming)
        before = came - coming
        if name in self.area:
            vessel, declared = self.vessels[name], self.outlets[name].declared
            assert declared is not None
            foot, section = vessel.floor - declared["tip"][1], vessel.section_m2
            let_out = run_out(
                self.inputs.times, self.area[name], coming * ML,
                discharge=declared["discharge"], section=section, foot=foot, volume=first * ML,
            ) / ML  # fmt: skip
            top = first + came - np.cumsum(let_out)
            over = np.minimum(top, np.maximum.accumulate(np.maximum(0.0, top - brim)))
            return let_out, np.diff(over, prepend=0.0), top - over
        # With all that came in taken off, what a vessel holds only falls: to what its tilt keeps, and to its brim.
        kept = self.kept.get(name, np.full(len(coming), np.inf)) - before
        bounds = np.stack([kept, brim - came], axis=1)
        low = np.minimum(first, np.minimum.accumulate(bounds.ravel())).reshape(-1, 2)
        previous = np.concatenate([[first], low[:-1, 1]])
        if name in self.most and (previous - low[:, 0] > self.most[name]).any():
            low = _lowered(first, bounds, self.most[name])
            previous = np.concatenate([[first], low[:-1, 1]])
        return previous - low[:, 0], low[:, 0] - low[:, 1], np.maximum(0.0, came + low[:, 1])

    def _kept(self, name: str) -> FloatArray:
        """Millilitres (T,) that a vessel's tilt keeps; infinite where its tilt is not known."""
        poses, vessel = self.poses[name], self.vessels[name]
        # A frame reached by a jump or a loss is no evidence of a tilt: a glitch of one frame would empty the glass.
        known = poses.valid & poses.linked
        # Of the first frame the next one tells.
        known[:1] |= poses.valid[:1] & poses.linked[1:2].all()
        if TURN_OUTLIER not in self.inputs.believed:
            known &= ~_turned_and_back(poses)
        self.doubtful[name] = poses.valid & ~known
        kept = np.full(len(known), np.inf)
        kept[known] = vessel.shape.kept_ml(_down(poses, known))
        return kept

    def _most(self, name: str) -> FloatArray:
        """Millilitres (T,) that can run over a tilted rim in the step up to each frame: its opening as a full weir."""
        down, width = _down(self.held[name], slice(None)), 2.0 * self.vessels[name].size("opening_radius")
        head = width * np.where(down[:, 1] < 0.0, np.hypot(down[:, 0], down[:, 2]), 1.0)
        most = np.diff(self.inputs.times, prepend=0.0) * over_weir(head, width) / ML
        # How long a vessel had been tilted before the recording is not known.
        most[:1] = np.inf
        return most

    def _aim(self, name: str, leaving: FloatArray) -> None:
        """Find where it falls in each frame in which it flows, if that is not known yet."""
        outlet = self.outlets[name]
        rows = np.flatnonzero((leaving > 0.0) & (outlet.target == UNKNOWN))
        if not len(rows):
            return
        poses = self.held[name]
        if outlet.declared is not None:
            local, velocity = np.array([outlet.declared["tip"]]), np.zeros((len(rows), 3))
        else:
            local, velocity = self.vessels[name].shape.exit(_down(poses, rows)), self._velocity(name, rows)
        start = poses.translation[rows] + np.einsum("tij,tj->ti", poses.rotation[rows], local * np.ones((len(rows), 1)))
        outlet.target[rows], outlet.point[rows] = self._landing(outlet.into, rows, start, velocity)

    def _landing(
        self, into: tuple[str, ...], rows: IntArray, start: FloatArray, velocity: FloatArray
    ) -> tuple[IntArray, FloatArray]:
        """Number of the vessel that it falls into and where it started, or `SPILLED` and where it lands."""
        best, target = np.full(len(rows), np.inf), np.full(len(rows), SPILLED)
        floor = np.full(len(rows), np.inf)
        for name in into:
            poses, vessel = self.held[name], self.vessels[name]
            turn, place = poses.rotation[rows], poses.translation[rows]
            centre = place + np.einsum("tij,j->ti", turn, vessel.place("opening"))
            time = entry_times(start, velocity, centre, turn[:, :, 1], vessel.size("opening_radius"))
            time = np.where(poses.valid[rows], time, np.inf)
            target, best = np.where(time < best, self.names.index(name), target), np.minimum(time, best)
            floor = np.where(poses.valid[rows], np.minimum(floor, place[:, 1]), floor)
        landed = places_at_height(start, velocity, np.where(np.isfinite(floor), floor, start[:, 1]))
        return target, np.where((target == SPILLED)[:, None], landed, start)

    def _velocity(self, name: str, rows: IntArray) -> FloatArray:
        """Of the lip (n, 3), which the liquid leaves with; at rest where the path about the frame is not known."""
        poses, local = self.poses[name], self.vessels[name].place("lip")
        near = np.unique(np.clip(rows[:, None] + np.arange(-HALF_WINDOW, HALF_WINDOW + 1), 0, len(poses.times) - 1))
        lips = np.zeros((len(poses.times), 3))
        lips[near] = poses.translation[near] + poses.rotation[near] @ local
        runs = settled_runs(poses.times, poses.valid, poses.linked)
        return np.nan_to_num(velocities(poses.times, lips, runs, rows))

    def _streams(self, name: str, leaving: FloatArray, over: FloatArray) -> list[Stream]:
        """What left a vessel for each place, and what ran over its brim."""
        parts = []
        if name in self.outlets:
            target, point = self.outlets[name].target, self.outlets[name].point
            for number in sorted(set(target[leaving > 0.0].tolist())):
                into = "" if number == SPILLED else self.names[number]
                parts.append((into, False, np.where(target == number, leaving, 0.0), point))
        if (over > 0.0).any():
            parts.append(("", True, over, self.held[name].point(self.vessels[name].place("opening"))))
        found = []
        for into, over_brim, volume, points in parts:
            rows = np.flatnonzero(volume > 0.0)
            found.append(Stream(name, into, over_brim, self.inputs.times[rows], rows, volume[rows], points[rows]))
        return found


def _turned_and_back(poses: BodyPoses) -> BoolArray:
    """(T,) whether the doctor calls a frame's rotation an outlier: reached and left faster than a hand turns."""
    outlier = np.zeros(len(poses.valid), dtype=np.bool_)
    rows = np.flatnonzero(poses.valid)
    if len(rows) > 2:
        steps = np.maximum(np.diff(poses.times[rows]), 1e-9)
        outlier[rows[1:]] = undone_turns(Rotation.from_matrix(poses.rotation[rows]).as_quat(), steps)
    return outlier


def _outlets(inputs: EffectInputs) -> dict[str, _Outlet]:
    """Vessel that gives -> its outlet, of all tables that declare one."""
    outlets: dict[str, _Outlet] = {}
    for declared in inputs.tables.get("burette", ()):
        outlets.setdefault(declared["body"], _Outlet(declared)).into += declared["into"]
    for declared in inputs.tables.get("pour", ()):
        for source in declared["from"]:
            others = tuple(name for name in declared["into"] if name != source)
            outlets.setdefault(source, _Outlet()).into += others
    return outlets


def _open_area(inputs: EffectInputs, declared: Declaration) -> FloatArray:
    """Open area (T,) in m2 of a stopcock; where its turn was not seen, as it was seen last."""
    key, stand = inputs.poses(declared["joint"]), inputs.poses(declared["body"])
    axis = np.array(declared["axis"])
    relative = key.relative_to(stand).held()
    angle = np.where(relative.valid, twist(relative.rotation, axis / np.sqrt(axis @ axis)), 0.0)
    angle = np.abs(np.degrees(angle))
    angle[angle < declared["closed_below_deg"]] = 0.0
    return declared["full_area_m2"] * np.minimum(1.0, angle / declared["full_angle_deg"])


def _lowered(first: float, bounds: FloatArray, most: FloatArray) -> FloatArray:
    """What is left of ``first`` (T, 2) by the tilt and brim of each frame, ``bounds``; a tilt takes ``most`` (T,)."""
    rows = np.flatnonzero(bounds.min(axis=1) < first)
    left, found = first, []
    for (kept, brim), limit in zip(bounds[rows].tolist(), most[rows].tolist(), strict=True):
        tilted = max(left - limit, min(left, kept))
        left = min(tilted, brim)
        found.append((tilted, left))
    low = np.full(bounds.shape, first)
    # Between these frames nothing leaves.
    low[rows[0] :] = np.repeat([after for _, after in found], np.diff(rows, append=len(low)))[:, None]
    low[rows] = found
    return low


def _down(poses: BodyPoses, rows: IntArray | BoolArray | slice) -> FloatArray:
    """The direction (n, 3) of gravity in the body's frame."""
    return -poses.rotation[rows][:, 1, :]
