"""Contacts that end and begin again within 100 ms while their shapes stay near, and the distance that joins them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import ceil
from typing import TYPE_CHECKING, Final

import numpy as np
from msgspec import structs

from cdcore import Detection
from cdcore.numerics import BoolArray, FloatArray, IntArray
from cdcore.protocol import PairDetector, counts_as_contact
from cdcore.protocol.settings import RateSettings
from replay.auditing.contact_counts import count_reports
from replay.auditing.episodes import episodes
from replay.auditing.holding import overlaps_holding
from replay.auditing.outcome import Episode, Outcome
from replay.auditing.record import Count, Fraction, Metres, Record
from replay.auditing.sampling_offsets import OffsetCounts, at_offset, counts_over_offsets, has_offsets
from replay.auditing.tolerance import Reference
from replay.detection.detector_spec import DetectorSpec
from replay.detection.progress import ignore_progress
from replay.detection.release_band import near_spec
from replay.detection.run_detector import Run, frames_within, make_detector, run_detector
from replay.detection.sample_times import sampled_frames
from replay.prepare.assembly import Assembly

if TYPE_CHECKING:
    from cdcore.narrow.mesh_stage import MeshStage

FLICKER_SECONDS: Final = 0.1
"""A contact that begins this soon after the last one of its pair ended is one contact, interrupted."""

WIDEST_RELEASE_M: Final = 0.005
"""Metres: shapes that part farther than this beyond the contact offset have left, however soon they are back."""

RELEASE_STEP_M: Final = 1e-4
"""Metres to whose multiples a release distance is rounded up."""

MOST_MEASURED_INTERRUPTIONS: Final = 400
"""Interruptions whose gap is measured in each sample, some milliseconds each; of more, the first ones."""

STAMP_ROUNDING_S: Final = 1e-6
"""Seconds by which stamps are rounded."""

SEPARATION_ROUNDING_M: Final = 1e-9
"""Metres by which a gap is rounded."""


@dataclass(frozen=True)
class Interruption:
    """Frames, both included, in which a detector reports no contact of a pair between two contacts soon after another.

    ``pair`` is the column under which its contacts are counted.
    """

    pair: int
    first: int
    last: int


class ReleaseDistance(Record, frozen=True):
    """A release distance that keeps contacts whole, and what a detector that has it reports of this session.

    Parameters
    ----------
    metres : between the shapes, up to which a contact lasts.
    begins : metres between the shapes from which there is contact: the contact offset of the detector.
    setting : the detector with it, as ``replay run --detectors`` takes it.
    contacts, interruptions : that it reports, and those that are left, without contacts of a hand and what it holds.
    false_contact, false_contact_without : fraction of the reported pair-frames that is no contact of the reference,
        with the distance and without; ``None``: there is no reference.
    """

    metres: Metres
    begins: Metres
    setting: str
    contacts: Count
    interruptions: Count
    false_contact: Fraction | None = None
    false_contact_without: Fraction | None = None


class Flicker(Record, frozen=True):
    """Contacts that end and begin again within 100 ms while the shapes stay within 5 mm beyond the contact offset.

    Contacts of a hand and what it holds are left out.

    Parameters
    ----------
    reported : contacts of the detector.
    contacts : of them those just before or after an interruption.
    interruptions : how many; so many contacts fewer there are without them.
    widest : metres between the shapes at most in these; ``None``: not measured in all of them.
    release : ``None``: the detector decides between frames, or has a release distance.
    """

    reported: Count
    contacts: Count
    interruptions: Count
    widest: Metres | None = None
    release: ReleaseDistance | None = None

    @property
    def joined(self) -> int:
        """Contacts that those beside an interruption are without the interruptions."""
        return self.contacts - self.interruptions


def interruptions_of(contacts: Sequence[Episode]) -> list[Interruption]:
    """Return the interruptions between the contacts of one detector, in order of time, then pair."""
    sorted_contacts = sorted(contacts, key=lambda contact: (contact.pair, contact.first))
    interruptions = [
        Interruption(before.pair, before.last + 1, after.first - 1)
        for before, after in pairwise(sorted_contacts)
        if before.pair == after.pair and after.start - before.end <= FLICKER_SECONDS + STAMP_ROUNDING_S
    ]
    return sorted(interruptions, key=lambda gap: (gap.first, gap.pair))


def flicker_of(contacts: Sequence[Episode], interruptions: Sequence[Interruption]) -> Flicker:
    """Return the number of interrupted contacts of one detector, without a release distance."""
    end_keys = {(gap.pair, gap.first - 1) for gap in interruptions}
    start_keys = {(gap.pair, gap.last + 1) for gap in interruptions}
    interrupted = [
        contact
        for contact in contacts
        if (contact.pair, contact.last) in end_keys or (contact.pair, contact.first) in start_keys
    ]
    return Flicker(reported=len(contacts), contacts=len(interrupted), interruptions=len(interruptions))


def find_flicker(
    runs: Mapping[str, Run],
    contacts: Mapping[str, Sequence[Episode]],
    assembly: Assembly,
    reference: Reference | None,
    offsets: Mapping[str, OffsetCounts],
    seed: int,
) -> dict[str, Flicker]:
    """Return the flicker of each detector, with the release distance that joins its contacts; none where none flickers.

    Parameters
    ----------
    contacts : label -> contacts; those of a hand and what it holds are not looked at.
    offsets : label -> counts at each sampling offset of a detector of a rate.
    """
    flicker: dict[str, Flicker] = {}
    for label, run in runs.items():
        counted_contacts = _not_grasped(contacts[label], assembly, reference)
        interruptions = _near_interruptions(interruptions_of(counted_contacts), run, assembly, seed)
        if not interruptions:
            continue
        flicker[label] = flicker_of(counted_contacts, interruptions)
        if run.detection.covers == "instants" and not run.spec.release:
            gaps = _gaps(interruptions[:MOST_MEASURED_INTERRUPTIONS], run, assembly, seed)
            release = _release_distance(gaps, run, assembly, reference, seed)
            false_proportion = _false_contact(run.detection, reference, offsets.get(label))
            flicker[label] = structs.replace(
                flicker[label],
                widest=float(gaps.max()) if len(gaps) == len(interruptions) else None,
                release=structs.replace(release, false_contact_without=false_proportion),
            )
    return flicker


def _not_grasped(contacts: Sequence[Episode], assembly: Assembly, reference: Reference | None) -> tuple[Episode, ...]:
    """The contacts without those of a hand and what it holds."""
    segments = np.array([(contact.pair, contact.first, contact.last) for contact in contacts], dtype=np.int64)
    segments = segments.reshape(-1, 3)
    is_pair_grasped = assembly.grasped[segments[:, 0]]
    if reference is not None:
        is_pair_grasped = is_pair_grasped | overlaps_holding(reference.holdings, *segments.T)
    return tuple(
        contact for contact, is_grasped in zip(contacts, is_pair_grasped.tolist(), strict=True) if not is_grasped
    )


def _release_distance(
    gaps: FloatArray, run: Run, assembly: Assembly, reference: Reference | None, seed: int
) -> ReleaseDistance:
    """Return the smallest release distance, rounded up, that is no less than any of the gaps, measured."""
    release_steps = max(1, ceil((float(gaps.max()) + SEPARATION_ROUNDING_M) / RELEASE_STEP_M))
    spec = replace(run.spec, release=round(release_steps * RELEASE_STEP_M, 6))
    return structs.replace(
        _measure_release(spec, assembly, reference, seed), begins=_largest_contact_offset(run, assembly)
    )


def _largest_contact_offset(run: Run, assembly: Assembly) -> float:
    """Metres between the shapes from which a detector reports contact: the largest contact offset of its pairs."""
    detector = run.detector
    if not isinstance(detector, PairDetector):
        return 0.0
    return max((detector.contact_reach(pair) for pair in range(len(assembly.pairs))), default=0.0)


def _measure_release(spec: DetectorSpec, assembly: Assembly, reference: Reference | None, seed: int) -> ReleaseDistance:
    """Return what a run of a detector with a release distance prints of it."""
    offsets = None
    if reference is not None and has_offsets(spec, len(assembly.motion)):
        offsets = counts_over_offsets(spec, assembly, reference, seed, is_live=False)
    offset_spec = spec if offsets is None else at_offset(spec, offsets)
    run = run_detector(offset_spec, assembly, seed=seed, faces=False, advance=ignore_progress)
    detection = run.detection
    contacts = episodes(detection, assembly.motion.valid, assembly.contact_columns)
    contacts = _not_grasped(contacts, assembly, reference)
    return ReleaseDistance(
        metres=spec.release,
        begins=0.0,
        setting=spec.text,
        contacts=len(contacts),
        interruptions=len(_near_interruptions(interruptions_of(contacts), run, assembly, seed)),
        false_contact=_false_contact(detection, reference, offsets),
    )


def _false_contact(detection: Detection, reference: Reference | None, offsets: OffsetCounts | None) -> float | None:
    """Fraction of the reported pair-frames that is false, over the sampling offsets where there are several."""
    if offsets is not None:
        return offsets.false_contact.value
    if reference is None:
        return None
    return count_reports(reference.compare(detection)).proportion(Outcome.FALSE_CONTACT).value


def _near_interruptions(
    interruptions: Sequence[Interruption], run: Run, assembly: Assembly, seed: int
) -> list[Interruption]:
    """The interruptions in which the shapes stay within ``WIDEST_RELEASE_M`` beyond the contact offset."""
    if not interruptions:
        return []
    within_reach = frames_within(
        _largest_contact_offset(run, assembly) + WIDEST_RELEASE_M, run.detector, assembly, seed
    )
    is_sampled = _sampled_frames(run, assembly)
    return [
        interruption
        for interruption in interruptions
        for frames in (_samples(interruption, is_sampled),)
        if any(within_reach[frames, column].all() for column in _columns_in_contact(interruption, run, assembly))
    ]


def _sampled_frames(run: Run, assembly: Assembly) -> BoolArray:
    """(T,) frames in which a detector samples; all of one that is none of our table."""
    settings = run.detector.settings
    rate_and_offset = (
        (settings.rate_hz, settings.sampling_offset_s) if isinstance(settings, RateSettings) else (None, 0.0)
    )
    return sampled_frames(assembly.motion.times, *rate_and_offset)


def _samples(interruption: Interruption, is_sampled: BoolArray) -> IntArray:
    """The frames of an interruption in which the detector samples."""
    frames = np.arange(interruption.first, interruption.last + 1)
    return frames[is_sampled[frames]] if is_sampled[frames].any() else frames


def _columns_in_contact(interruption: Interruption, run: Run, assembly: Assembly) -> list[int]:
    """The columns of a pair, or of the members of a group, that are in contact just before an interruption."""
    verdicts_before = run.detection.verdict[interruption.first - 1]
    columns = assembly.columns_of_contact(interruption.pair)
    return [
        column for column, contact in zip(columns, counts_as_contact(verdicts_before[columns]), strict=True) if contact
    ]


def _gaps(interruptions: Sequence[Interruption], run: Run, assembly: Assembly, seed: int) -> FloatArray:
    """Metres (n,) by which the shapes of a detector part in the samples of each interruption."""
    # Here, since a run without flicker loads no collision engine for it.
    from cdcore.narrow.mesh_stage import MeshStage

    shape_detector = make_detector(near_spec(run.detector, 0.0), assembly, seed)
    stage = MeshStage(getattr(shape_detector, "colliders", assembly.bodies), assembly.pairs)
    is_sampled = _sampled_frames(run, assembly)
    return np.array([_widest_gap(gap, run, assembly, stage, _samples(gap, is_sampled)) for gap in interruptions])


def _widest_gap(
    interruption: Interruption, run: Run, assembly: Assembly, stage: "MeshStage", frames: IntArray
) -> float:
    """Metres by which the shapes part in some frames; of the members of a group, those that part least."""
    largest_gaps = []
    for column in _columns_in_contact(interruption, run, assembly):
        frames_with_pose = frames[assembly.motion.valid[frames][:, assembly.pairs[column]].all(axis=1)]
        largest_gaps.append(
            max((stage.gap(assembly.motion, frame, column)[0] for frame in frames_with_pose.tolist()), default=0.0)
        )
    return max(0.0, min(largest_gaps, default=0.0))
