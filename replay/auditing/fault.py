"""A wrong answer of a detector about one pair: a missed, late, cut short or false contact, with its cause."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import StrEnum
from math import inf, isnan, nan
from operator import itemgetter
from typing import Final

from cdcore.numerics import IntArray
from replay.auditing.outcome import FirstTouch
from replay.effects.output import Vector


class FaultCategory(StrEnum):
    """The two ways to be wrong; the values are the options of ``replay view``."""

    MISS = "miss"
    """The reference has a contact that the detector does not report."""
    FALSE_CONTACT = "false"
    """The detector reports a contact that the reference does not have."""


class FaultKind(StrEnum):
    """The position of a fault within the contact or the report that it belongs to."""

    NEVER_REPORTED = "never found"
    REPORTED_LATE = "found late"
    LOST_EARLY = "lost early"
    INTERRUPTED = "interrupted"
    NO_CONTACT = "nothing there"
    STARTS_EARLY = "starts early"
    ENDS_LATE = "ends late"
    JOINS_TWO = "joins two contacts"

    @property
    def is_miss(self) -> bool:
        """Whether a contact was missed, late or cut short."""
        return self in MISS_KINDS

    @property
    def category(self) -> FaultCategory:
        """Whether a contact was missed or a false one reported."""
        return FaultCategory.MISS if self.is_miss else FaultCategory.FALSE_CONTACT


MISS_KINDS: Final = (FaultKind.NEVER_REPORTED, FaultKind.REPORTED_LATE, FaultKind.LOST_EARLY, FaultKind.INTERRUPTED)
"""Kinds of missed contact."""

MISS_NAMES: Final = {
    FaultKind.NEVER_REPORTED: "missed contact",
    FaultKind.REPORTED_LATE: "late contact",
    FaultKind.LOST_EARLY: "short contact",
    FaultKind.INTERRUPTED: "interrupted contact",
}
"""Kind -> noun of a contact that was reported in part or never; all are numbered together."""


class Cause(StrEnum):
    """The stage of a detector that made a fault."""

    TOLERANCE = "within tolerance"
    """Contact by less than tau: too small to decide, and no miss."""
    BETWEEN_FRAMES = "between frames"
    """No instant shows it; only an oracle of intervals does."""
    BETWEEN_SAMPLES = "between samples"
    """The detector did not examine that frame."""
    BETWEEN_STEPS = "between physics steps"
    """No step of the engine falls into what its reports miss."""
    CLOCK = "clock"
    """Within what is not known of the detector's clock."""
    COLLIDER_SHAPE = "collider shape"
    """The colliders that replace the meshes do not meet."""
    LATE = "late"
    """The detector says the same a constant number of frames later, or an engine began to report the contact late."""
    EARLY = "early"
    """The same earlier, or an engine's report of the contact ended early."""
    CONTAINMENT = "inside, not tested"
    """One body is inside the other, and the detector does not test that."""
    SPHERE_STAGE = "sphere stage"
    """Volumes dismissed it before any triangle was asked."""
    SAMPLING = "sampling"
    """No pair of faces that meets is in the sample."""
    BUDGET = "budget ran out"
    """Ten times the budget finds it, spent from some frames before."""
    SEARCH = "search"
    """In the sample, not found; nor with ten times the budget, where that can be asked."""
    UNEXPLAINED = "unexplained"
    """No stage explains it."""
    NOT_EXAMINED = "not examined"
    """There were too many misses to examine this one."""
    BOUNDING_VOLUMES = "only bounding volumes overlap"
    """A candidate, whose triangles no stage tested: such a contact is *unconfirmed*."""
    CONTACT_OFFSET = "contact offset"
    """The colliders do not meet, and are nearer to each other than the detector's contact offset reaches."""
    COLLIDERS_MEET = "colliders meet, surfaces do not"
    """The colliders that replace the meshes meet."""
    HULL_FILLS_HOLLOW = "hull fills a hollow"
    """A vertex of the other body is in a convex hull, and outside the mesh that the hull replaces."""
    RELEASE_DISTANCE = "within its release distance"
    """The contact had begun, and lasts until the shapes are farther apart than the detector's release distance."""
    LAST_ANSWER = "held since its last sample"
    """The detector keeps its answer until its next sample."""


FALSE_CAUSES: Final = (
    Cause.BOUNDING_VOLUMES,
    Cause.CONTACT_OFFSET,
    Cause.COLLIDERS_MEET,
    Cause.HULL_FILLS_HOLLOW,
    Cause.RELEASE_DISTANCE,
    Cause.LAST_ANSWER,
)
"""Causes of false contacts alone."""

MISS_CAUSES: Final = tuple(cause for cause in Cause if cause not in FALSE_CAUSES)
"""Causes of missed contacts, in the order of the summary."""


@dataclass(frozen=True, slots=True)
class Evidence:
    """Geometry at the moment to look at a fault.

    Parameters
    ----------
    normal : unit vector from the first body to the second across the curve of a miss.
    face_pairs : face pairs that meet there.
    touch : first touch on the way to the first frame, where no frame shows the contact of a miss; the point and the
        normal are then taken at that moment, ``face_pairs`` is 1 and the curve has no length yet.
    faces : (k, 2) face pairs that meet, or the pair that touches first, where no detection lists them.
    nearest : nearest points of both surfaces of a false contact.
    hollow : name of the body whose convex hull fills a hollow, where that is the cause.
    """

    normal: Vector = (0.0, 1.0, 0.0)
    face_pairs: int = 0
    touch: FirstTouch | None = None
    faces: IntArray | None = field(default=None, compare=False, repr=False)
    nearest: tuple[Vector, Vector] | None = None
    hollow: str = ""


@dataclass(frozen=True, slots=True)
class Fault:
    """A missed, late, cut short or false contact; its number is the same in every table, list and picture.

    Parameters
    ----------
    number : 1, 2, ... in order of time, of one detector and category.
    detector : label of the detector.
    pair : column of the pair; ``bodies`` are the names of its two bodies.
    kind : position within the contact or the report.
    first, last : first and last frame, both included.
    start, end : seconds at which the first frame begins and the last one is over.
    frame : of a miss the frame with the longest intersection curve, of a false contact that with the widest gap.
    point : world metres; on the curve of a miss, in the middle of the gap of a false contact.
    metres : length of the curve, or width of the gap; nan: not measured.
    depth : of a miss, metres from the deepest point of one body in the other to its surface; nan: not measured.
    volume : of a miss, cubic metres that both bodies have in common at that frame; nan: not measured.
    depth_at_least : whether frames of it were left out of the search for the deepest one.
    not_measured : why the depth was not measured, as a clause: ``beaker is open``; ``""``: it was, or is not of a miss.
    evidence : geometry there.
    contact : number of the missed contact of the reference, from 1; 0 for a false contact.
    cause : stage that made the fault.
    agreeing : examined frames that have this cause, and all examined frames.
    why : sentence about the cause.
    labels : names of its two bodies for a sentence, a member of a group with that of its group: ``hand (thumb)``.
    noise : whether the missed contact holds in spite of tracker noise; ``""``: not asked for.
    noise_fraction : fraction of noisy copies that have the missed contact; ``None``: not asked for.
    grasped : whether a hand holds the body meanwhile, or a body is the other's parent.
    """

    number: int
    detector: str
    pair: int
    bodies: tuple[str, str]
    kind: FaultKind
    first: int
    last: int
    start: float
    end: float
    frame: int
    point: Vector = (0.0, 0.0, 0.0)
    metres: float = nan
    depth: float = nan
    volume: float = nan
    depth_at_least: bool = False
    not_measured: str = ""
    evidence: Evidence = Evidence()
    contact: int = 0
    cause: Cause = Cause.NOT_EXAMINED
    agreeing: tuple[int, int] = (0, 0)
    why: str = ""
    noise: str = ""
    noise_fraction: float | None = None
    grasped: bool = False
    labels: tuple[str, str] = ("", "")

    @property
    def name(self) -> str:
        """``late contact``, ``false contact`` or, where no triangle was tested, ``unconfirmed contact``."""
        if self.kind.is_miss:
            return MISS_NAMES[self.kind]
        return "unconfirmed contact" if self.cause is Cause.BOUNDING_VOLUMES else "false contact"

    @property
    def frames(self) -> int:
        """Number of its frames."""
        return self.last - self.first + 1

    @property
    def moment(self) -> tuple[int, int]:
        """Moment to look at: a frame, and nanoseconds after it."""
        touch = self.evidence.touch
        return (self.frame, 0) if touch is None else (touch.frame, touch.later_ns)

    @property
    def begin_within(self) -> tuple[float, float]:
        """Second at which it begins, and seconds by which a first touch between frames is uncertain."""
        touch = self.evidence.touch
        return (self.start, 0.0) if touch is None else (touch.moment, touch.moment - touch.free)


def worst_first(faults: Iterable[Fault]) -> list[Fault]:
    """Faults of one category in the order of every table, list and picture.

    Misses by depth, then those of unknown depth by the length of their curve; false contacts by the width of their gap.
    Equals, to a micrometre, are in order of time.
    """
    keyed_faults = [
        ((-_micrometres(fault.depth), -_micrometres(fault.metres), fault.number), fault) for fault in faults
    ]
    keyed_faults.sort(key=itemgetter(0))
    return [fault for _, fault in keyed_faults]


def _micrometres(metres: float) -> float:
    """Whole micrometres; below all others where nothing was measured."""
    return -inf if isnan(metres) else round(1e6 * metres)
