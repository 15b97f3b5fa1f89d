"""A wrong answer of a run about one pair, with all that is needed to decide it again on less."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any, Final

import numpy as np
from msgspec.structs import asdict

from cdcore import Body, Motion, create_detector
from cdcore.detectors import load_detector
from cdcore.errors import CollisionCoreError
from cdcore.numerics import FloatArray, IntArray
from cdcore.poses import place_points
from cdcore.protocol import counts_as_contact, is_undecided
from replay import words
from replay.auditing.fault import Fault
from replay.auditing.sampling_offsets import OFFSET_SETTING
from replay.detection.detector_spec import parse_detector
from replay.detection.recorded import RECORDED
from replay.engine import prepare
from replay.errors import RunFolderError, ShrinkError
from replay.prepare.assembly import Assembly
from replay.show.results.run_folder import RunFolder
from sessions import read_session

WINDOWS: Final = (1.0, 10.0, 100.0, np.inf)
"""Seconds before the wrong answer that are tried in turn: most detectors remember less than a second."""


@dataclass(frozen=True, eq=False)
class WrongAnswer:
    """Wrong answer of a detector in the last frame of a motion."""

    # detector, settings: as ``create_detector`` takes them
    detector: str
    settings: Mapping[str, Any]
    oracle: str  # name of the detector that answers rightly
    # bodies, motion: N bodies and their T poses
    bodies: tuple[Body, ...]
    motion: Motion
    pairs: IntArray  # (P, 2) body numbers; the first is the pair in question
    contact: bool  # whether there is contact in the last frame

    @property
    def pair(self) -> tuple[Body, Body]:
        """The two bodies in question."""
        first, second = self.pairs[0].tolist()
        return self.bodies[first], self.bodies[second]

    def stands(self) -> bool:
        """Whether the detector still answers wrongly, and the oracle still as it did; input it refuses does not."""
        try:
            return self._says(self.oracle, {}) is self.contact and self._says(self.detector, self.settings) is (
                not self.contact
            )
        except CollisionCoreError:
            return False

    def _says(self, name: str, settings: Mapping[str, Any]) -> bool | None:
        verdict = create_detector(name, self.bodies, pairs=self.pairs, **settings).detect(self.motion).verdict[-1, :1]
        return None if is_undecided(verdict)[0] else bool(counts_as_contact(verdict)[0])

    def corners(self, body: int) -> FloatArray:
        """The triangles (F, 3, 3) of a body in the last frame."""
        pose = self.motion.rotations[-1, body], self.motion.translations[-1, body]
        return place_points(self.bodies[body].mesh.triangles, *pose)


def of_run(
    run: RunFolder,
    *,
    miss: int | None = None,
    false: int | None = None,
    label: str | None = None,
    session: Path | None = None,
    scene: Path | None = None,
) -> WrongAnswer:
    """The fault of a run folder: a miss or a false contact by its number.

    ``label``: the detector, where the run audited several, or ``module:Class``: a folder may come from anybody, so a
    detector of no table is imported only where the caller names it. ``session``: the recording, where it lies neither
    in the run folder, nor beside it, nor in the working directory; ``scene``: that of the run, where it was not the
    recording's. Raises ``ShrinkError``: no such fault, a detector that may not be imported or whose answers came with
    the recording, or a fault that does not happen again; ``RunFolderError``: no recording or scene, or those of another
    run.
    """
    stored = _stored_fault(run, miss, false, label)
    contact = stored.kind.is_miss
    trusted, label = parse_detector(label).name if label else None, stored.detector
    detector = run.document.detectors[label]
    if ":" in detector.name and detector.name != trusted:
        raise ShrinkError(
            f"{run.path} was made with {detector.name}, a class of somebody's own code; "
            f"to import and run it, add --detector {label}={detector.name}"
        )
    if detector.name == RECORDED:
        raise ShrinkError(f"{label} is what an engine reported while it ran; it cannot run on less")
    if detector.settings.get("shape") == "shipped":
        raise ShrinkError(
            f"{label} tests colliders that came with the recording, which a test of two meshes cannot hold"
        )
    oracle = "continuous" if run.document.detectors[run.document.oracle].covers == "intervals" else "exact"
    usual = vars(load_detector(detector.name).Settings())
    settings = {key: value for key, value in detector.settings.items() if value != usual.get(key)}
    assembly = _assembled(run, session, scene)
    names = [body.name for body in assembly.bodies]
    first_body, second_body = stored.bodies
    pair = names.index(first_body), names.index(second_body)
    frames = [stored.frame] if contact else range(stored.first, stored.last + 1)
    for frame, pairs, first in product(frames, _selections(assembly, pair), WINDOWS):
        began = int(np.searchsorted(assembly.motion.times, assembly.motion.times[frame] - first))
        motion = assembly.motion.take(np.arange(began, frame + 1))
        fault = of_pairs(WrongAnswer(detector.name, settings, oracle, assembly.bodies, motion, pairs, contact))
        # The first frame is sampled at any offset, so most faults stand without one.
        plain = {key: value for key, value in settings.items() if key != OFFSET_SETTING}
        for candidate in (replace(fault, settings=plain), fault):
            if candidate.stands():
                return candidate
    raise ShrinkError(
        f"run again on {first_body} and {second_body} at {words.timestamp(stored.start)} s, {label} is right; "
        "its answer depended on the clock"
    )


def of_pairs(fault: WrongAnswer) -> WrongAnswer:
    """The same with the bodies of its pairs only."""
    kept = np.unique(fault.pairs)
    motion = fault.motion
    poses = motion.translations[:, kept], motion.rotations[:, kept], motion.valid[:, kept]
    moved = Motion(motion.times, *poses, linked=motion.linked[:, kept])
    bodies = tuple(fault.bodies[k] for k in kept)
    return replace(fault, bodies=bodies, motion=moved, pairs=np.searchsorted(kept, fault.pairs))


def _selections(assembly: Assembly, pair: tuple[int, int]) -> Iterator[IntArray]:
    """The pair alone, and before the others, which share a budget of the frame with it."""
    alone = np.array([pair], dtype=np.int64)
    yield alone
    yield np.concatenate([alone, assembly.pairs[(np.sort(assembly.pairs) != np.sort(alone)).any(axis=1)]])


def _stored_fault(run: RunFolder, miss: int | None, false: int | None, detector: str | None) -> Fault:
    """Return the fault of a run folder by its number.

    ``detector``: the label of its detector, its ``module:Class``, or ``label=module:Class``.
    """
    names = {label: run.document.detectors[label].name for label in run.document.audit}
    among = [
        label
        for label, name in names.items()
        if detector in (None, label) or (":" in name and detector in (name, f"{label}={name}"))
    ]
    if detector is not None and not among:
        raise ShrinkError(f"{run.path} audited no {detector}; it audited: {', '.join(names) or 'nothing'}")
    if miss is not None:
        run.require_miss(miss)
    number, what = (miss, "miss") if miss is not None else (false, "false contact")
    faults = [
        fault
        for label in among
        for fault in run.faults[label]
        if fault.number == number and fault.kind.is_miss == (miss is not None)
    ]
    if len(faults) > 1:
        labels = ", ".join(fault.detector for fault in faults)
        raise ShrinkError(f"several detectors have one of that number; add --detector with one of: {labels}")
    if not faults:
        raise ShrinkError(f"{run.path} has no {what} {number}" + (f" of {detector}" if detector else ""))
    return faults[0]


def _assembled(run: RunFolder, session: Path | None, scene: Path | None) -> Assembly:
    """Bodies, poses and pairs as the run had them."""
    recording = run.recording(session, scene)
    prepared = prepare(read_session(recording, scene=scene), policy=run.document.policy, **asdict(run.document.window))
    run.require_digest(recording, prepared.repaired.digest)
    replayed, assembly = run.document.session, prepared.assembly
    if len(assembly.motion) != replayed.frames or {*assembly.names} != {*replayed.bodies}:
        raise RunFolderError(f"{run.path} speaks of other frames or bodies than its recording has; run it again")
    return assembly
