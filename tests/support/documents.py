"""Records of the document of a run, made by hand: what a test does not state is zero, none or empty."""

from msgspec import convert, structs

from replay.auditing.wilson import proportion
from replay.document import audit as records
from replay.document.detector import DetectorRecord, DetectorTimes, SampleTimes
from replay.document.run_document import RunDocument

NONE = proportion(0, 0)
COUNTS = records.CountRange(smallest=0, largest=0, mean=0.0)


def zeros(record, **counts):
    """A record of counts, all 0 but those given."""
    return record(**(dict.fromkeys(record.__struct_fields__, 0) | counts))


MATCHING = records.ContactMatching(
    **dict.fromkeys(records.ContactMatching.__struct_fields__, 0)
    | {"missed_proportion": NONE, "false_proportion": NONE}
    | {"onset_error": None, "duration_error": None, "end_error": None}
)


def offset_ranges(missed=0, late=0):
    """The same counts at every sampling offset."""
    same = [records.CountRange(smallest=count, largest=count, mean=float(count)) for count in (missed, late)]
    return records.OffsetRanges(contacts_missed=same[0], late_or_cut_short=same[1])


def audit_of(**fields):
    """The audit of a detector with some values; ranges over the sampling offsets are those of its counts."""
    empty = dict.fromkeys(records.DetectorAudit.__struct_fields__, 0)
    empty |= {
        "pair_frames": zeros(records.PairFrames), "time_missed": NONE, "false_contact": NONE, "undecided": NONE,
        "undecided_reasons": {}, "reference_undecided_reasons": {}, "between_frames": records.NOT_EXAMINED,
        "while_grasped": zeros(records.GraspedCounts), "misses_by_kind": {}, "false_causes": {},
        "means_over_offsets": None, "noise_proof": None, "matching": MATCHING,
        "causes": records.CauseCounts(misses={}, pair_frames={}, examined=0, missed=0),
        "counts_over_offsets": offset_ranges(fields.get("contacts_missed", 0), fields.get("late_or_cut_short", 0)),
    }  # fmt: skip
    return records.DetectorAudit(**empty | fields)


def times_of(mean=4e-4, p99=None):
    """Seconds of a detector; without ``p99`` it was not timed frame by frame."""
    samples = SampleTimes(median=p99, p95=p99, p99=p99, max=p99, samples=1, over_budget=0.0, stages={}) if p99 else None
    return DetectorTimes(
        prepare=0.0, warm_up=0.0, detect=100 * mean, per_frame_mean=mean, stages={}, longest_stage=None,
        sample_times=samples,
    )  # fmt: skip


def detector_of(name, spec=None, **fields):
    """A detector of a run that was asked live."""
    usual = {
        "settings": {}, "covers": "instants", "online": True, "live": True, "approximate": False, "contacts": 0,
        "faces_queried": False, "verdicts": {}, "seconds": times_of(), "work": {}, "digest": None, "faces_digest": None,
    }  # fmt: skip
    return DetectorRecord(name=name, spec=spec or name, **usual | fields)


EMPTY = convert(
    {
        "schema": "vrlab-replay/run/2", "caveat": "", "intervals": "", "window": {"start": None, "end": None},
        "session": {
            "id": "0" * 16, "recording": None, "digest": None, "scene": "", "frames": 1, "duration": 0.0,
            "median_step": 0.0, "dropped_frames": {"repeated": 0, "backwards": 0}, "first_stamp_ns": 0, "left_out": [],
            "notes": [], "facts": {}, "facts_withheld": 0, "assumptions": [], "bodies": {},
        },
        "settings": {
            "detectors": [], "oracle": "none", "step_rate": 50.0, "pairs": None, "start": None, "end": None,
            "policy": {}, "noise": [], "noise_copies": 16, "seed": 0, "tau": 0.0, "offline": False,
        },
        "seed": 0, "tau": 0.0, "pairs": [], "oracle": "", "detectors": {}, "audit": {}, "noise": None, "policy": {},
        "findings": [], "flagged": [], "flagged_verdicts": {}, "versions": {}, "machine": {}, "effects": {},
        "plan": {
            "effects": {}, "pairs": None, "bodies": {}, "topics": {}, "detectors": {}, "detection": True, "not_run": [],
        },
        "answers": [],
    },
    RunDocument,
)  # fmt: skip


def document_with(**fields):
    """A document with some values."""
    return structs.replace(EMPTY, **fields)
