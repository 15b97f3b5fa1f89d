"""The session that was replayed: its recording, its bodies, and what was in doubt about its poses."""

from typing import Annotated, Any, Literal

from msgspec import Meta

from replay.auditing.record import Count, Digest, Record, Seconds


class RecordingMark(Record, frozen=True):
    """By what a recording is known again, whatever its file is called."""

    bytes: Count
    sha256: Digest


class DroppedFrames(Record, frozen=True):
    """Frames of the recording that were left out, by what is wrong with their stamps."""

    repeated: Count
    backwards: Count

    @property
    def total(self) -> int:
        """All of them."""
        return self.repeated + self.backwards


class AssumptionRecord(Record, frozen=True):
    """One thing that an import assumed of its source."""

    subject: str
    value: str
    sentence: str


class BodyRecord(Record, frozen=True):
    """A body of the session; ``proxy``: a mesh stands in for its own."""

    faces: Annotated[int, Meta(ge=1)]
    proxy: bool


class SessionRecord(Record, frozen=True):
    """The session, without anything that leads to a person.

    Parameters
    ----------
    id : 16 hex digits over every pose and the stretch that was replayed.
    recording : the file, by its content; ``None``: a session in memory.
    digest : of the recording, before any repair.
    scene : its name, or ``""``.
    frames, duration, median_step : of the stretch that was replayed, in seconds.
    first_stamp_ns : of the first frame.
    left_out : bodies without a mesh.
    notes : sentences about the scene.
    facts : those that may leave the session file; ``facts_withheld`` counts the others.
    assumptions : of the import.
    bodies : by name.
    """

    id: Annotated[str, Meta(pattern="^[0-9a-f]{16}$")]
    recording: RecordingMark | None
    digest: str | None
    scene: str
    frames: Count
    duration: Seconds
    median_step: Seconds
    dropped_frames: DroppedFrames
    first_stamp_ns: int
    left_out: tuple[str, ...]
    notes: tuple[str, ...]
    facts: dict[str, str]
    facts_withheld: Count
    assumptions: tuple[AssumptionRecord, ...]
    bodies: dict[str, BodyRecord]


class FindingRecord(Record, frozen=True):
    """One finding of the doctor about the recording."""

    code: str
    severity: Literal["note", "warning", "error"]
    body: str | None
    start: float | None
    end: float | None
    start_ns: int | None
    end_ns: int | None
    count: Count
    message: str
    meaning: str
    fix: str


class FlaggedPoses(Record, frozen=True):
    """Consecutive frames of one body with poses in doubt, and what the policy did with them.

    ``body`` is ``""`` for all of them; ``dropped``, ``held`` and ``interpolated`` are samples that became this.
    """

    kind: str
    body: str
    start_ns: int
    end_ns: int
    start: float
    end: float
    samples: Count
    action: str
    dropped: Count
    held: Count
    interpolated: Count


class SettingsRecord(Record, frozen=True):
    """Every setting of a run, with the detectors and the reference that they came to."""

    detectors: tuple[str, ...]
    oracle: str
    step_rate: Annotated[float, Meta(gt=0.0)]
    pairs: tuple[tuple[str, ...], ...] | None
    start: float | None
    end: float | None
    policy: dict[str, str]
    noise: tuple[str, ...]
    noise_copies: int
    seed: int
    tau: float
    offline: bool
    fix_time: Seconds = 0.0


class Window(Record, frozen=True):
    """Seconds after the first frame between which was replayed; ``None``: from its start, to its end."""

    start: float | None
    end: float | None


class NoiseRecord(Record, frozen=True):
    """Tracker noise that copies of the recording got; ``sizes``: body -> metres, radians, seconds."""

    copies: Annotated[int, Meta(ge=1)]
    sizes: dict[str, tuple[Seconds, Seconds, Seconds]]


class PlanRecord(Record, frozen=True):
    """The needs of the scene: effects, pairs, bodies, topics and detectors, each with the reasons for it."""

    effects: dict[str, tuple[str, ...]]
    pairs: dict[str, tuple[str, ...]] | None
    bodies: dict[str, tuple[str, ...]]
    topics: dict[str, tuple[str, ...]]
    detectors: dict[str, tuple[str, ...]]
    detection: bool
    not_run: tuple[str, ...]


class EffectRecord(Record, frozen=True):
    """An effect of a run: why it ran, what it took, and what it found.

    Parameters
    ----------
    about : one sentence.
    because : why it ran.
    seconds, fraction : its time, and of that of the run.
    frames, frames_run : of the session, and those in which its trigger let it run.
    trigger : ``""``: always.
    counters : its work.
    events : name -> how many.
    digest : over its output.
    sources : citations.
    """

    about: str
    because: tuple[str, ...]
    seconds: Seconds
    fraction: float
    frames: Count
    frames_run: Count
    trigger: str
    counters: dict[str, int | float]
    events: dict[str, Count]
    digest: str
    sources: tuple[Any, ...]
