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
from cdcore.detectors.detector_table import load_detector
from cdcore.errors import CHOICE_ERRORS, CollisionCoreError
from cdcore.numerics import FloatArray, IntArray
from cdcore.poses import place_points
from cdcore.protocol import counts_as_contact, is_undecided
from replay import words
from replay.auditing.fault import Fault
from replay.auditing.sampling_offsets import OFFSET_SETTING
from replay.detection.detector_spec import parse_detector
from replay.detection.recorded import RECORDED_DETECTOR
from replay.engine import prepare
from replay.errors import RunFolderError, ShrinkError
from replay.prepare.assembly import Assembly
from replay.show.results.run_folder import RunFolder
from sessions import read_session

UNSHRINKABLE_SHAPES: Final = {
    "shipped": "colliders that came with the recording",
    "compound": "convex pieces of the meshes",
}
"""Setting ``shape`` of a detector -> what it tests, which a test of two meshes cannot hold."""

WINDOWS_S: Final = (1.0, 10.0, 100.0, np.inf)
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

    def is_reproduced(self) -> bool:
        """Whether the detector still answers wrongly, and the oracle still as it did; input it refuses does not.

        Raises ``CHOICE_ERRORS``: the detector cannot be made, whatever the input.
        """
        try:
            return self.is_wrong()
        except CHOICE_ERRORS:
            raise
        except CollisionCoreError:
            return False

    def is_wrong(self) -> bool:
        """Whether the detector answers wrongly, and the oracle as it did.

        Raises ``CollisionCoreError``: one of them refuses the input, or cannot be made.
        """
        return self.reports_contact(self.oracle, {}) is self.contact and self.reports_contact(
            self.detector, self.settings
        ) is (not self.contact)

    def reports_contact(self, name: str, settings: Mapping[str, Any]) -> bool | None:
        """Whether a detector reports contact of the pair in the last frame; ``None``: it is undecided."""
        verdict = create_detector(name, self.bodies, pairs=self.pairs, **settings).detect(self.motion).verdict[-1, :1]
        return None if is_undecided(verdict)[0] else bool(counts_as_contact(verdict)[0])

    def corners(self, body: int) -> FloatArray:
        """The triangles (F, 3, 3) of a body in the last frame."""
        pose = self.motion.rotations[-1, body], self.motion.translations[-1, body]
        return place_points(self.bodies[body].mesh.triangles, *pose)


def fault_of_run(
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
    run; ``CollisionCoreError``: a detector that cannot be made, or that refuses what it answered in the run.
    """
    stored_fault = _stored_fault(run, miss, false, label)
    contact = stored_fault.kind.is_miss
    trusted_class, label = parse_detector(label).name if label else None, stored_fault.detector
    detector = run.document.detectors[label]
    if ":" in detector.name and detector.name != trusted_class:
        raise ShrinkError(
            f"{run.path} was made with {detector.name}, a class of somebody's own code; "
            f"to import and run it, add --detector {label}={detector.name}"
        )
    if detector.name == RECORDED_DETECTOR:
        raise ShrinkError(f"{label} is what an engine reported while it ran; it cannot run on less")
    tested_solids = UNSHRINKABLE_SHAPES.get(str(detector.settings.get("shape")))
    if tested_solids is not None:
        raise ShrinkError(f"{label} tests {tested_solids}, which a test of two meshes cannot hold")
    oracle = "continuous" if run.document.detectors[run.document.oracle].covers == "intervals" else "exact"
    default_settings = vars(load_detector(detector.name).Settings())
    settings = {key: value for key, value in detector.settings.items() if value != default_settings.get(key)}
    assembly = _assemble_run(run, session, scene)
    names = [body.name for body in assembly.bodies]
    first_body, second_body = stored_fault.bodies
    pair = names.index(first_body), names.index(second_body)
    frames = [stored_fault.frame] if contact else range(stored_fault.first, stored_fault.last + 1)
    for frame, pairs, first in product(frames, _selections(assembly, pair), WINDOWS_S):
        first_row = int(np.searchsorted(assembly.motion.times, assembly.motion.times[frame] - first))
        motion = assembly.motion.take(np.arange(first_row, frame + 1))
        fault = reduce_to_pairs(WrongAnswer(detector.name, settings, oracle, assembly.bodies, motion, pairs, contact))
        # The first frame is sampled at any offset, so most faults stand without one.
        settings_without_offset = {key: value for key, value in settings.items() if key != OFFSET_SETTING}
        for candidate in (replace(fault, settings=settings_without_offset), fault):
            if candidate.is_reproduced():
                return candidate
    moment = words.timestamp(float(fault.motion.times[-1]))
    raise ShrinkError(f"run again on {first_body} and {second_body} at {moment} s, {_answers_of_rerun(fault, label)}")


def _answers_of_rerun(fault: WrongAnswer, label: str) -> str:
    """Return the end of a sentence: what the oracle or the detector answers about a fault that does not happen again.

    Raises ``CollisionCoreError``: one of them refuses the run's own frames, which is no answer.
    """
    report_of_contact = {True: "contact", False: "no contact"}
    oracle_contact = fault.reports_contact(fault.oracle, {})
    if oracle_contact is not fault.contact:
        answer = "is undecided" if oracle_contact is None else f"reports {report_of_contact[oracle_contact]}"
        return f"{fault.oracle} {answer}; in the run the reference reported {report_of_contact[fault.contact]}"
    detector_contact = fault.reports_contact(fault.detector, fault.settings)
    if detector_contact is None:
        answer = "is undecided"
    elif detector_contact is fault.contact:
        answer = "is right"
    else:  # it was not wrong a moment ago, about the same
        return f"{label} changes its answer from one rerun to the next"
    return f"{label} {answer}; in the run it was wrong: its answer may depend on the clock"


def reduce_to_pairs(fault: WrongAnswer) -> WrongAnswer:
    """The same with the bodies of its pairs only."""
    kept_bodies = np.unique(fault.pairs)
    motion = fault.motion
    poses = motion.translations[:, kept_bodies], motion.rotations[:, kept_bodies], motion.valid[:, kept_bodies]
    reduced_motion = Motion(motion.times, *poses, linked=motion.linked[:, kept_bodies])
    bodies = tuple(fault.bodies[k] for k in kept_bodies)
    return replace(fault, bodies=bodies, motion=reduced_motion, pairs=np.searchsorted(kept_bodies, fault.pairs))


def _selections(assembly: Assembly, pair: tuple[int, int]) -> Iterator[IntArray]:
    """The pair alone, and before the others, which share a budget of the frame with it."""
    single_pair = np.array([pair], dtype=np.int64)
    yield single_pair
    yield np.concatenate([single_pair, assembly.pairs[(np.sort(assembly.pairs) != np.sort(single_pair)).any(axis=1)]])


def _stored_fault(run: RunFolder, miss: int | None, false: int | None, detector: str | None) -> Fault:
    """Return the fault of a run folder by its number.

    ``detector``: the label of its detector, its ``module:Class``, or ``label=module:Class``.
    """
    names = {label: run.document.detectors[label].name for label in run.document.audit}
    matching_labels = [
        label
        for label, name in names.items()
        if detector in (None, label) or (":" in name and detector in (name, f"{label}={name}"))
    ]
    if detector is not None and not matching_labels:
        raise ShrinkError(f"{run.path} audited no {detector}; it audited: {', '.join(names) or 'nothing'}")
    if miss is not None:
        run.require_miss(miss)
    number, what = (miss, "miss") if miss is not None else (false, "false contact")
    faults = [
        fault
        for label in matching_labels
        for fault in run.faults[label]
        if fault.number == number and fault.kind.is_miss == (miss is not None)
    ]
    if len(faults) > 1:
        labels = ", ".join(fault.detector for fault in faults)
        raise ShrinkError(f"several detectors have one of that number; add --detector with one of: {labels}")
    if not faults:
        raise ShrinkError(f"{run.path} has no {what} {number}" + (f" of {detector}" if detector else ""))
    return faults[0]


def _assemble_run(run: RunFolder, session: Path | None, scene: Path | None) -> Assembly:
    """Bodies, poses and pairs as the run had them."""
    recording = run.find_recording(session, scene)
    preparation = prepare(
        read_session(recording, scene=scene), policy=run.document.policy, **asdict(run.document.window)
    )
    run.require_digest(recording, preparation.repaired.digest)
    session_document, assembly = run.document.session, preparation.assembly
    if len(assembly.motion) != session_document.frames or {*assembly.names} != {*session_document.bodies}:
        raise RunFolderError(f"{run.path} speaks of other frames or bodies than its recording has; run it again")
    return assembly
