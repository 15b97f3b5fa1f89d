"""A detector of a run: its settings, its verdicts, and the seconds that it took."""

from typing import Annotated, Any, Literal, TypeAlias

from msgspec import Meta

from replay.auditing.flicker import Flicker
from replay.auditing.record import Count, Counts, Digest, Fraction, Metres, Record, Seconds


class Quantiles(Record, frozen=True):
    """Seconds of a sample."""

    median: Seconds
    p95: Seconds
    p99: Seconds
    max: Seconds


class SampleTimes(Record, frozen=True):
    """Seconds over the samples: the frames on which the detector ran.

    Parameters
    ----------
    samples : how many.
    over_budget : fraction of them that took longer than a frame of the headset.
    stages : the same of each stage.
    """

    median: Seconds
    p95: Seconds
    p99: Seconds
    max: Seconds
    samples: Count
    over_budget: Fraction
    stages: dict[str, Quantiles]


class LongestStage(Record, frozen=True):
    """The stage that takes most of the time."""

    stage: str
    fraction: Fraction


class DetectorTimes(Record, frozen=True, kw_only=True):
    """Seconds that a detector took.

    Parameters
    ----------
    prepare, warm_up, detect : for the whole session.
    per_frame_mean : for a frame, over all frames, without the time that other programs took.
    processor_fraction : of the seconds on the clock those in which this process ran; ``None``: not measured.
    stages : for the whole session.
    longest_stage : ``None`` where no stage took time.
    sample_times : ``None``: frames were not timed one by one.
    at_every_frame : a frame in the mean of the same detector without its rate; ``None``: not measured.
    """

    prepare: Seconds
    warm_up: Seconds
    detect: Seconds
    per_frame_mean: Seconds
    processor_fraction: Fraction | None = None
    stages: dict[str, Seconds]
    longest_stage: LongestStage | None
    sample_times: SampleTimes | None = None
    at_every_frame: Seconds | None = None

    @property
    def p99(self) -> float | None:
        """Seconds in which 99 of 100 samples were decided; ``None``: not timed one by one."""
        return None if self.sample_times is None else self.sample_times.p99


VerdictName: TypeAlias = Annotated[
    str, Meta(pattern="^(clear|contact|contained|candidate|not_found|unresolved|invalid|no_pose)$")
]


class DetectorRecord(Record, frozen=True):
    """A detector of a run.

    Parameters
    ----------
    name : of the table of detectors, or ``module:Class``.
    spec : the name with the settings given: ``discrete[rate_hz=50]``.
    settings : every setting, defaults included.
    covers : whether it decides at frames or between them.
    online : whether it can be asked frame by frame.
    live : whether it was.
    approximate : whether it may miss contacts by construction.
    contacts : how many it reports.
    faces_queried : whether it listed faces within ``seconds``; live, a second pass lists them, which is not timed.
    verdicts : verdict -> pair-frames; those of none are left out.
    seconds : what it took.
    work : counters.
    digest, faces_digest : SHA-256 of verdicts and faces.
    release : metres between the shapes up to which a contact lasts, once it has begun.
    flicker : its interrupted contacts; ``None``: there are none.
    """

    name: str
    spec: str
    settings: dict[str, Any]
    covers: Literal["instants", "intervals"]
    online: bool
    live: bool
    approximate: bool
    contacts: Count
    faces_queried: bool
    verdicts: dict[VerdictName, Count]
    seconds: DetectorTimes
    work: Counts
    digest: Digest | None
    faces_digest: Digest | None
    release: Metres = 0.0
    flicker: Flicker | None = None
