"""How liquid moves between vessels: one account for all that tilt, run out and run over, whoever declared them.

In every frame each vessel gives by the state of the frame before: what its tilt does not keep, no more than a weir as
wide as its opening lets over, what its stopcock lets out; then what stands above a brim runs over. What comes in turns
into what a vessel holds by running minima; only where the weir is the limit, by the frames in which it may give. Rounds
over the vessels repeat that until nothing changes. Each settles one more hand-over in a row, so that rounds are few.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from cdcore.numerics import FloatArray, IntArray
from replay.effects.declaring import Declaration
from replay.effects.fitting import settled_runs, velocities
from replay.effects.inputs import BodyPoses, EffectInputs
from replay.effects.models.outflow import Stream, entry_times, points_at_height, run_out, twist_angle, weir_flow
from replay.effects.output import Series
from replay.effects.spans import BoolArray
from replay.effects.vessels import M3_PER_ML, Vessel, vessels_of
from sessions.doctor.track_watch import undone_rotations

SPILLED, UNKNOWN = -1, -2


@dataclass(frozen=True, eq=False)
class Movement:
    """Vessel -> what it holds in every frame, millilitres (T,), and all streams between them."""

    vessels: Mapping[str, Vessel]
    volume_ml: Mapping[str, FloatArray]
    streams: tuple[Stream, ...]

    def changes(self, times: FloatArray, name: str) -> Series:
        """A vessel's volume wherever it changed, and at the first and the last frame."""
        streams_of_vessel = [stream for stream in self.streams if name in (stream.source, stream.target)]
        return volumes(times, streams_of_vessel, self.volume_ml[name])


def volumes(times: FloatArray, streams: Sequence[Stream], volume_ml: FloatArray) -> Series:
    """Millilitres at the frames of some streams, and at the first and the last frame."""
    rows = np.unique(np.concatenate([[0, len(times) - 1], *(stream.frames for stream in streams)]))
    return Series(times[rows], volume_ml[rows], "mL")


def gone_ml(count: int, streams: Iterable[Stream]) -> FloatArray:
    """Millilitres (T,) of all streams together in each frame."""
    gone_volume = np.zeros(count)
    for stream in streams:
        gone_volume[stream.frames] += stream.volume_ml
    return gone_volume


def movement_of(inputs: EffectInputs) -> Movement:
    """The movement of this run, made once."""
    return inputs.shared_object("movement", lambda: _compute_movement(inputs))


def _compute_movement(inputs: EffectInputs) -> Movement:
    placed_vessels = _placed_vessels(inputs)
    names, count = list(placed_vessels), len(inputs)
    inflow = {name: np.zeros(count) for name in placed_vessels}
    while True:
        outflows = {name: placed.outflows(inflow[name]) for name, placed in placed_vessels.items()}
        next_inflow = {name: np.zeros(count) for name in placed_vessels}
        for source, (outflow_ml, _, _) in outflows.items():
            target = placed_vessels[source].target_numbers(outflow_ml, placed_vessels)
            for number in set(target[outflow_ml > 0.0].tolist()) - {SPILLED}:
                next_inflow[names[number]] += np.where(target == number, outflow_ml, 0.0)
        if all(np.array_equal(next_inflow[name], inflow[name]) for name in placed_vessels):
            break
        inflow = next_inflow
    return Movement(
        {name: placed.vessel for name, placed in placed_vessels.items()},
        {name: staying for name, (_, _, staying) in outflows.items()},
        tuple(
            stream for name, placed in placed_vessels.items() for stream in placed.streams(names, *outflows[name][:2])
        ),
    )


class _PlacedVessel:
    """A vessel: what leaves it, where to and from which point.

    ``tap``: the table of a burette; ``receivers``: vessels that may receive; ``None``: it gives nothing.
    """

    def __init__(
        self, inputs: EffectInputs, vessel: Vessel, tap: Declaration | None, receivers: tuple[str, ...] | None
    ) -> None:
        self.inputs, self.vessel, self.tap, self.receivers = inputs, vessel, tap, receivers or ()
        self.poses = inputs.poses(vessel.body.id)
        self.last_known, count = self.poses.last_known(), len(inputs)
        self.target, self.point = np.full(count, UNKNOWN), np.zeros((count, 3))  # (T,) number of a vessel, (T, 3)
        self.kept_volume = self.weir_limit = np.full(count, np.inf)
        if tap is not None:
            self.area = _open_area(inputs, tap) * self.last_known.valid
        elif receivers is not None:
            self.kept_volume, self.weir_limit = self._volume_kept_by_tilt(), self._weir_limit()

    def outflows(self, inflow: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Volumes that leave by tilt or stopcock, run over, and stay, each (T,), with what comes in."""
        initial_volume, brim = self.vessel.volume_ml, self.vessel.brim_ml
        total_inflow = np.cumsum(inflow)
        if self.tap is not None:
            let_out = (
                run_out(
                    self.inputs.times,
                    self.area,
                    inflow * M3_PER_ML,
                    discharge=self.tap["discharge"],
                    section=self.vessel.section_m2,
                    foot=self.vessel.floor - self.tap["tip"][1],
                    volume=initial_volume * M3_PER_ML,
                )
                / M3_PER_ML
            )
            filled_volume = initial_volume + total_inflow - np.cumsum(let_out)
            overflow = np.minimum(filled_volume, np.maximum.accumulate(np.maximum(0.0, filled_volume - brim)))
            return let_out, np.diff(overflow, prepend=0.0), filled_volume - overflow
        # With all that came in taken off, what a vessel holds only falls: to what its tilt keeps, and to its brim.
        volume_bounds = np.stack([self.kept_volume - (total_inflow - inflow), brim - total_inflow], axis=1)
        lowest = np.minimum(initial_volume, np.minimum.accumulate(volume_bounds.ravel())).reshape(-1, 2)
        previous_volume = np.concatenate([[initial_volume], lowest[:-1, 1]])
        if (previous_volume - lowest[:, 0] > self.weir_limit).any():
            lowest = _remaining_volumes(initial_volume, volume_bounds, self.weir_limit)
            previous_volume = np.concatenate([[initial_volume], lowest[:-1, 1]])
        return previous_volume - lowest[:, 0], lowest[:, 0] - lowest[:, 1], np.maximum(0.0, total_inflow + lowest[:, 1])

    def target_numbers(self, leaving_ml: FloatArray, placed_vessels: "Mapping[str, _PlacedVessel]") -> IntArray:
        """Number (T,) of the vessel that it falls into in each frame in which it flows, or `SPILLED`."""
        rows = np.flatnonzero((leaving_ml > 0.0) & (self.target == UNKNOWN))
        if len(rows):
            if self.tap is not None:
                tip_point, velocity = np.array([self.tap["tip"]]), np.zeros((len(rows), 3))
            else:
                tip_point, velocity = (
                    self.vessel.shape.exit(_gravity_direction(self.last_known, rows)),
                    self._velocity(rows),
                )
            offset = np.einsum("tij,tj->ti", self.last_known.rotation[rows], tip_point * np.ones((len(rows), 1)))
            self._note_landing(rows, self.last_known.translation[rows] + offset, velocity, placed_vessels)
        return self.target

    def streams(self, names: list[str], leaving_ml: FloatArray, overflow: FloatArray) -> Iterator[Stream]:
        """Yields the stream to each target, and the one over its brim."""
        receivers = dict(enumerate(names)) | {SPILLED: ""}
        openings = [
            (receivers[number], False, np.where(self.target == number, leaving_ml, 0.0), self.point)
            for number in sorted(set(self.target[leaving_ml > 0.0].tolist()))
        ]
        openings.append(("", True, overflow, self.last_known.point(self.vessel.point("opening"))))
        for name, over_brim, volume, points in openings:
            rows = np.flatnonzero(volume > 0.0)
            if len(rows):
                times = self.inputs.times[rows]
                yield Stream(self.vessel.body.id, name, over_brim, times, rows, volume[rows], points[rows])

    def _volume_kept_by_tilt(self) -> FloatArray:
        """Millilitres (T,) that its tilt keeps; infinite where its tilt is not known."""
        poses = self.poses
        # A frame reached by a jump or a loss is no evidence of a tilt: a glitch of one frame would empty the glass.
        is_known_pose = poses.valid & poses.linked
        # Of the first frame the next one tells.
        is_known_pose[:1] |= poses.valid[:1] & poses.linked[1:2].all()
        is_known_pose &= ~_flipped_once(poses)
        kept_volume = np.full(len(is_known_pose), np.inf)
        kept_volume[is_known_pose] = self.vessel.shape.kept_ml(_gravity_direction(poses, is_known_pose))
        return kept_volume

    def _weir_limit(self) -> FloatArray:
        """Millilitres (T,) that can run over a tilted rim in the step up to each frame: its opening as a full weir."""
        gravity, width = _gravity_direction(self.last_known, slice(None)), 2.0 * self.vessel.size("opening_radius")
        head = width * np.where(gravity[:, 1] < 0.0, np.hypot(gravity[:, 0], gravity[:, 2]), 1.0)
        weir_limit = np.diff(self.inputs.times, prepend=0.0) * weir_flow(head, width) / M3_PER_ML
        # How long a vessel had been tilted before the recording is not known.
        weir_limit[:1] = np.inf
        return weir_limit

    def _note_landing(
        self, rows: IntArray, start: FloatArray, velocity: FloatArray, placed_vessels: "Mapping[str, _PlacedVessel]"
    ) -> None:
        """Note into which vessel it falls, and where it started; if into none, where it lands."""
        nearest_time, target = np.full(len(rows), np.inf), np.full(len(rows), SPILLED)
        floor_height = np.full(len(rows), np.inf)
        for name in self.receivers:
            poses, vessel = placed_vessels[name].last_known.take(rows), placed_vessels[name].vessel
            centre = poses.translation + np.einsum("tij,j->ti", poses.rotation, vessel.point("opening"))
            time = entry_times(start, velocity, centre, poses.rotation[:, :, 1], vessel.size("opening_radius"))
            time = np.where(poses.valid, time, np.inf)
            target, nearest_time = (
                np.where(time < nearest_time, [*placed_vessels].index(name), target),
                np.minimum(time, nearest_time),
            )
            floor_height = np.where(poses.valid, np.minimum(floor_height, poses.translation[:, 1]), floor_height)
        landing_points = points_at_height(
            start, velocity, np.where(np.isfinite(floor_height), floor_height, start[:, 1])
        )
        self.target[rows], self.point[rows] = target, np.where((target == SPILLED)[:, None], landing_points, start)

    def _velocity(self, rows: IntArray) -> FloatArray:
        """Velocity of the lip (n, 3), which the liquid leaves with; 0 where the path about the frame is not known."""
        poses, times = self.poses, self.inputs.times
        lip_points = poses.translation + poses.rotation @ self.vessel.point("lip")
        return np.nan_to_num(velocities(times, lip_points, settled_runs(times, poses.valid, poses.linked), rows))


def _flipped_once(poses: BodyPoses) -> BoolArray:
    """(T,) whether the doctor calls a frame's rotation an outlier: reached and left faster than a hand turns."""
    is_outlier = np.zeros(len(poses.valid), dtype=np.bool_)
    rows = np.flatnonzero(poses.valid)
    if len(rows) > 2:
        step_seconds = np.maximum(np.diff(poses.times[rows]), 1e-9)
        is_outlier[rows[1:]] = undone_rotations(Rotation.from_matrix(poses.rotation[rows]).as_quat(), step_seconds)
    return is_outlier


def _placed_vessels(inputs: EffectInputs) -> dict[str, _PlacedVessel]:
    """Every vessel between which liquid moves, by name; those that give know which may receive."""
    tap_of_vessel: dict[str, Declaration] = {}
    receivers_of_source: dict[str, tuple[str, ...]] = {}
    for declared in inputs.tables.get("burette", ()):
        tap_of_vessel.setdefault(declared["body"], declared)
        receivers_of_source[declared["body"]] = receivers_of_source.get(declared["body"], ()) + declared["into"]
    for declared in inputs.tables.get("pour", ()):
        for source in declared["from"]:
            other_receivers = tuple(name for name in declared["into"] if name != source)
            receivers_of_source[source] = receivers_of_source.get(source, ()) + other_receivers
    names = dict.fromkeys(name for source, targets in receivers_of_source.items() for name in (source, *targets))
    return {
        name: _PlacedVessel(inputs, vessel, tap_of_vessel.get(name), receivers_of_source.get(name))
        for name, vessel in vessels_of(inputs, names).items()
    }


def _open_area(inputs: EffectInputs, declared: Declaration) -> FloatArray:
    """Open area (T,) in m2 of a stopcock; where its turn was not seen, as it was seen last."""
    key_poses, stand_poses = inputs.poses(declared["joint"]), inputs.poses(declared["body"])
    axis = np.array(declared["axis"])
    key_in_stand = key_poses.relative_to(stand_poses).last_known()
    angle = np.where(key_in_stand.valid, twist_angle(key_in_stand.rotation, axis / np.sqrt(axis @ axis)), 0.0)
    angle = np.abs(np.degrees(angle))
    angle[angle < declared["closed_below_deg"]] = 0.0
    return declared["full_area_m2"] * np.minimum(1.0, angle / declared["full_angle_deg"])


def _remaining_volumes(initial_volume: float, volume_bounds: FloatArray, weir_limit: FloatArray) -> FloatArray:
    """Volume (T, 2) left of ``initial_volume`` by the ``volume_bounds`` of tilt and brim.

    A tilt takes ``weir_limit`` (T,).
    """
    rows = np.flatnonzero(volume_bounds.min(axis=1) < initial_volume)
    remaining_volume, lowered_volumes = initial_volume, []
    for (kept_volume, brim), limit in zip(volume_bounds[rows].tolist(), weir_limit[rows].tolist(), strict=True):
        volume_after_tilt = max(remaining_volume - limit, min(remaining_volume, kept_volume))
        remaining_volume = min(volume_after_tilt, brim)
        lowered_volumes.append((volume_after_tilt, remaining_volume))
    lowest = np.full(volume_bounds.shape, initial_volume)
    # Between these frames nothing leaves.
    lowest[rows[0] :] = np.repeat(
        [volume_after for _, volume_after in lowered_volumes], np.diff(rows, append=len(lowest))
    )[:, None]
    lowest[rows] = lowered_volumes
    return lowest


def _gravity_direction(poses: BodyPoses, rows: IntArray | BoolArray | slice) -> FloatArray:
    """The direction (n, 3) of gravity in the body's frame."""
    return -poses.rotation[rows][:, 1, :]
