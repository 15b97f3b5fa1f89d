"""Builds, warms up and times one detector over one motion; a long motion goes in blocks, with the same digest."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, fields, replace
from functools import partial
from time import perf_counter, process_time
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from cdcore import Detection, Detector, Motion, Verdict, create_detector, join
from cdcore.detectors.detector_table import TABLE, load_detector, settings_of
from cdcore.errors import CollisionCoreError, OwnDetectorError
from cdcore.narrow.sections.section_source import section_of_frame
from cdcore.numerics import BoolArray
from cdcore.protocol import ZeroOrderHold, counts_as_contact, detect_live, own_failure, stream_live
from cdcore.protocol.settings import RateSettings
from replay.cutting.compound import cuts_of_bodies, with_pieces
from replay.cutting.piece_store import Cut
from replay.detection.detector_spec import RELEASE_SETTING, DetectorSpec
from replay.detection.progress import Advance, ignore_progress
from replay.detection.recorded import RECORDED_DETECTOR, recorded_detector
from replay.detection.release_band import ReleaseBand, near_spec
from replay.errors import DetectorSpecError, ReplayError
from replay.prepare.assembly import Assembly
from sessions.model.constants import BLOCK_FRAMES

if TYPE_CHECKING:
    from cdcore.search.tracing import Watched

MOST_FRAMES_PER_CALL: Final = BLOCK_FRAMES
"""Up to here a motion is detected in one call, beyond it in blocks of this size. The verdicts are the same."""

FRAMES_PER_LIVE_REPORT: Final = 2048
"""Frames after which a detector that is asked live reports how far it is."""

MOST_FRAMES_IN_MEMORY: Final = 324_000
"""Up to here (an hour at 90 Hz) every frame is drawn, and what a search did and all faces that meet are kept."""

WARM_UP_FRAMES: Final = 128
"""Frames of each of the two warm-up samples: kernels compile on them, so that the time reported holds no compiling."""


MOST_FACE_PAIRS: Final = 8_000_000
"""Face pairs kept of a session of hours, 64 MB, twice that while joined; of more only the verdicts are kept."""


@dataclass(frozen=True, eq=False)
class Run:
    """One detector's answer and what it took."""

    spec: DetectorSpec  # what was asked for
    detector: Detector  # ready to be asked again
    settings: Mapping[str, Any]  # all settings in force, as plain data
    detection: Detection  # the answer
    live: bool  # whether it was asked one frame after the other; else the whole motion at once
    faces: bool  # whether it was asked which faces meet, and lists them, within the seconds below
    # prepare, warm, detect: seconds to build the detector, to warm it up, and to detect; asked live, the sum of the
    # looks
    prepare: float
    warm: float
    detect: float
    # of the seconds of the looks those in which this process was at work; ``None`` if not asked live
    processor_fraction: float | None = None
    # seconds in which this process was at work while it was asked live; ``None`` if not asked live
    processor_seconds: float | None = None
    # (T, P) contact that it reports only because of its release distance; ``None``: it has none
    prolonged: BoolArray | None = None

    @property
    def seconds_per_frame(self) -> float:
        """Mean over all frames, by the clock, but no more than this process was at work for where that was measured.

        On a busy machine other programs took 0.31 of the 0.39 s of a detector within 24 of 5,400 frames: by the clock
        its mean was above its 99th percentile.
        """
        # A clock of processes that did not move says nothing: that of Windows moves every 16 ms.
        seconds = min(self.detect, self.processor_seconds or self.detect)
        return seconds / max(1, len(self.detection.times))


def make_detector(spec: DetectorSpec, assembly: Assembly, seed: int) -> Detector:
    """The detector of a spec for the bodies and pairs of an assembly; the run's seed goes to those that draw.

    ``recorded`` is the one that is no row of the core's table: its answers come with the session.

    Raises
    ------
    UnknownDetectorError, InvalidSettingError, MissingEngineError
    """
    if spec.name == RECORDED_DETECTOR:
        return recorded_detector(
            assembly.bodies,
            assembly.pairs,
            assembly.live_contacts,
            assembly.first_ns,
            assembly.live_residual,
            spec.settings,
        )
    settings, detector_class = dict(spec.settings), load_detector(spec.name)
    if "seed" in {setting_field.name for setting_field in fields(detector_class.Settings)}:
        settings.setdefault("seed", seed)
    bodies = assembly.bodies
    if spec.name == "collider" and settings.get("shape") == "compound":
        bodies = with_pieces(bodies, assembly.pairs, settings_of(spec.name, settings))
    with blame_detector(spec, detector_class, "to be made"):
        return create_detector(spec.name, bodies, pairs=assembly.pairs, **settings)


def cuts_of_spec(spec: DetectorSpec, assembly: Assembly) -> dict[str, Cut]:
    """Name of each body that is cut when the detector of a spec is made -> its cut; none but for a compound."""
    if spec.name != "collider" or spec.settings.get("shape") != "compound":
        return {}
    return cuts_of_bodies(assembly.bodies, assembly.pairs, settings_of(spec.name, spec.settings))


@contextmanager
def blame_detector(spec: DetectorSpec, detector_class: type, action: str) -> Iterator[None]:
    """An exception in a detector that is not of our table is a fault of its code, and says where."""
    try:
        yield
    except (CollisionCoreError, ReplayError):
        raise
    except Exception as error:
        if spec.name in (*TABLE, RECORDED_DETECTOR):
            raise
        raise own_failure(action, detector_class, error) from error


def run_detector(
    spec: DetectorSpec, assembly: Assembly, *, seed: int, faces: bool, advance: Advance, live: bool = False
) -> Run:
    """Detect over the whole assembly; with ``faces`` the face pairs of every contact are kept.

    ``live``: ask one frame after the other, if the detector can be asked so; faces come from a pass of their own then.
    """
    clock = [perf_counter()]
    detector = make_detector(spec, assembly, seed)
    clock.append(perf_counter())
    motion, live = assembly.motion, live and detector.online
    with blame_detector(spec, type(detector), "to detect"):
        # What fails on the sample fails below too, under the number that the frame has in the recording.
        with suppress(OwnDetectorError):
            sample = motion.take(warm_frames(len(motion)))
            # Looks compile too what they need for rare ties only.
            warm_detection = detector.detect(sample, faces=faces)
            faces = faces and warm_detection.face_sets is not None
            if live:
                detect_live(detector, sample)
        clock.append(perf_counter())
        at_work = process_time()
        if live:
            live_detection = join(_with_progress(stream_live(detector, motion.blocks(FRAMES_PER_LIVE_REPORT)), advance))
            at_work, clock_seconds = process_time() - at_work, perf_counter() - clock[-1]
            with_faces = detect_all(detector, assembly, faces=True) if faces else live_detection
            detection = replace(
                with_faces, verdict=live_detection.verdict, work=live_detection.work, seconds=live_detection.seconds
            )
        else:
            detection = detect_all(detector, assembly, faces=faces, advance=advance)
    clock.append(perf_counter())
    detector_band = release_band(spec, detector, assembly, seed)
    prolonged = None
    if detector_band is not None:
        detection, prolonged = _prolong_contacts(detection, detector, detector_band)
    prepare, warm, detect = np.diff(clock).tolist()
    fraction = processor_seconds = None
    if live:
        detect = float(sum(np.sum(stage) for stage in detection.seconds.values()))
        fraction, processor_seconds = min(1.0, at_work / clock_seconds), at_work
    return Run(
        spec,
        detector,
        asdict(detector.settings),
        detection,
        live,
        faces and not live,
        prepare,
        warm,
        detect,
        fraction,
        processor_seconds,
        prolonged,
    )


def release_band(spec: DetectorSpec, detector: Detector, assembly: Assembly, seed: int) -> ReleaseBand | None:
    """The frames within the release distance of a detector; ``None``: its spec has no such distance."""
    return ReleaseBand(frames_within(spec.release, detector, assembly, seed)) if spec.release else None


def frames_within(metres: float, detector: Detector, assembly: Assembly, seed: int) -> BoolArray:
    """(T, P) frames in which the shapes that a detector puts in place of the meshes are at most so far apart."""
    near_detector = make_detector(near_spec(detector, metres), assembly, seed)
    return counts_as_contact(detect_all(near_detector, assembly).verdict)


def _prolong_contacts(detection: Detection, detector: Detector, band: ReleaseBand) -> tuple[Detection, BoolArray]:
    """A detection whose contacts last to the release distance, and the contact (T, P) that is there because of it."""
    if detection.covers != "instants":
        raise DetectorSpecError(
            f"{detection.detector} decides between frames; leave {RELEASE_SETTING} out of its settings"
        )
    settings, times = detector.settings, detection.times
    rate_and_offset = (
        (settings.rate_hz, settings.sampling_offset_s) if isinstance(settings, RateSettings) else (None, 0.0)
    )
    samples, has_pose = ZeroOrderHold(len(detection.pairs), *rate_and_offset), detection.verdict != Verdict.NO_POSE
    sampled_frames = samples.sampled(times)
    lasting_verdicts = band.prolonged_verdicts(detection.verdict[sampled_frames], sampled_frames)
    verdict, _ = samples.hold(lasting_verdicts, has_pose[sampled_frames], sampled_frames, has_pose)
    is_prolonged = counts_as_contact(verdict) & ~counts_as_contact(detection.verdict)
    return replace(detection, verdict=verdict), is_prolonged


def detect_all(
    detector: Detector, assembly: Assembly, *, faces: bool = False, advance: Advance = ignore_progress
) -> Detection:
    """Detection of every frame, many frames a call; long motions are split into blocks."""
    motion = assembly.motion
    if len(motion) <= MOST_FRAMES_PER_CALL:
        detection = detector.detect(motion, faces=faces)
        advance(len(motion))
        return detection
    blocks = _with_progress(detector.stream(motion.blocks(MOST_FRAMES_PER_CALL), faces=faces), advance)
    return _joined_blocks(blocks, detector, assembly) if len(motion) > MOST_FRAMES_IN_MEMORY else join(blocks)


def watched_again(detector: object, motion: Motion) -> Watched | None:
    """Trace of each stage of a search, from a second search; ``None`` for other detectors and long motions."""
    # Here, since a run without a search loads no compiler.
    from cdcore.search.tracing import Watchable

    return detector.watch(motion) if len(motion) <= MOST_FRAMES_IN_MEMORY and isinstance(detector, Watchable) else None


def _joined_blocks(blocks: Iterator[Detection], detector: Detector, assembly: Assembly) -> Detection:
    """Join the blocks of a motion of hours; their faces are dropped when there are too many."""
    kept_blocks: list[Detection] = []
    face_rows = 0
    for block in blocks:
        face_rows += 0 if block.face_sets is None else len(block.face_sets.faces)
        if face_rows > MOST_FACE_PAIRS or holds_answers(asdict(detector.settings)):
            kept_blocks = [replace(detection, face_sets=None) for detection in kept_blocks]
            block = replace(block, face_sets=None)
        kept_blocks.append(replace(block, section_source=None))
    joined_detection = join(kept_blocks)
    if joined_detection.face_sets is None:
        return joined_detection
    return replace(
        joined_detection, section_source=partial(section_of_frame, assembly.bodies, assembly.pairs, assembly.motion)
    )


def holds_answers(settings: Mapping[str, Any]) -> bool:
    """Whether a detector with these settings looks at a rate: between its looks, faces are those of an earlier pose."""
    return settings.get("rate_hz") is not None


def _with_progress(blocks: Iterator[Detection], advance: Advance) -> Iterator[Detection]:
    for block in blocks:
        yield block
        advance(len(block.times))


def warm_frames(frame_count: int) -> np.ndarray[Any, np.dtype[np.int64]]:
    """Frame numbers to warm up on: consecutive ones in the middle, and a sample of the whole that holds contacts."""
    middle_frames = np.arange(frame_count // 2, min(frame_count, frame_count // 2 + WARM_UP_FRAMES))
    spread = np.linspace(0, max(0, frame_count - 1), min(frame_count, WARM_UP_FRAMES)).astype(np.int64)
    return np.unique(np.concatenate([middle_frames, spread]))
