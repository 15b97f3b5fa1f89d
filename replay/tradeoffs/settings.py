"""The fixed list of what is tried: every algorithm, and every axis on which accuracy costs, cheap and telling first.

The list is the same on every machine with the same extras and in every run; a time limit cuts its tail.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.util import find_spec
from typing import Any, Final

from replay.base.constants import HEADSET_HZ
from replay.detection.detector_spec import DetectorSpec, SpecsLike, parse_detectors


@dataclass(frozen=True)
class Setting:
    """One point of the picture: a detector, what is turned (``axis``, such as ``step rate``) and how far (``value``).

    ``settings`` are the detector's; ``cell`` metres of the grid that makes meshes coarser, 0: as recorded; ``faces``
    says whether every face pair is listed; ``named`` is a label that somebody chose.
    """

    detector: str
    axis: str
    value: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    cell: float = 0.0
    faces: bool = False
    named: str = ""

    @property
    def label(self) -> str:
        """Unique in the list: ``hybrid-qaco samples 240``; ``hybrid faces`` needs no axis to be understood."""
        if self.named or self.axis == AS_IT_COMES:
            return self.named or self.detector
        return " ".join((self.detector, *([] if self.axis == ASKED else [self.axis]), self.value))

    @property
    def line(self) -> str:
        """Points of one line in the picture: one algorithm, one axis."""
        return self.label if self.axis == AS_IT_COMES else f"{self.detector}, {self.axis}"

    @property
    def spec(self) -> DetectorSpec:
        """What to run."""
        return DetectorSpec(self.named or self.detector, self.detector, dict(self.settings))

    @property
    def complete(self) -> bool:
        """Whether it says of every frame, by every face as recorded, only if bodies meet: nothing is sampled or cut."""
        needs = COMPLETE.get(self.detector)
        cut = any(self.settings.get(key) for key in ("budget", "rate_hz", "epsilon")) or bool(self.cell) or self.faces
        return needs is not None and not cut and needs.items() <= {"containment": True, **self.settings}.items()

    @property
    def simplicity(self) -> int:
        """Less is simpler: fewer settings changed, then the place in ``COMPLETE``; decides where times are a tie."""
        names = [*COMPLETE]
        place = names.index(self.detector) if self.detector in names else len(names)
        return (len(self.settings) + self.faces + bool(self.cell)) * (len(names) + 1) + place


COMPLETE: Final[Mapping[str, Mapping[str, Any]]] = {
    name: {"containment": True}
    for name in ("exact", "hybrid", "discrete", "static", "solid-style", "rapid-style", "obb", "aabb")
} | {"collider": {"shape": "mesh"}, "hybrid-qaco": {"decide": "mesh", "containment": True}}
"""Detectors that can miss nothing at a frame, and the settings which that takes; the simpler to explain come first."""

AS_IT_COMES: Final = "as it comes"

ASKED: Final = "booleans or faces"
"""The axis of what is asked: every face pair that meets, beside the detector as it comes, which only says whether."""

EARLY_RATES: Final = (10.0, 22.5, 45.0)
RATES: Final = (HEADSET_HZ, 60.0, 72.0, 5.0, 2.0)
"""Looks per second: from a slow poll to the headset's own rate; 45 and more are what engines ship. Three come early, so
that 20 seconds say what looking less often saves."""

COLLIDER_RATES: Final = (4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 15.0, 22.5, 45.0)
"""Denser where most is lost: this is the cheap end of the front."""

CELLS_MM: Final = (1.0, 2.0, 5.0, 10.0)
SAMPLES: Final = (30, 120, 480, 1920, "auto")
"""Faces of each body that a search samples."""

BUDGETS: Final = (30, 120, 480, 1920, 7680)
"""Evaluations that a search may spend on a pair and frame."""

TREE_BUDGETS: Final = (30, 100, 300, 1000, 3000)
TOLERANCES_MM: Final = (1.0, 0.1, 0.01)
FIRST: Final = ("exact", "hybrid", "solid-style", "sphere", "hybrid-qaco")
SLOW: Final = ("static", "discrete", "rapid-style", "obb", "aabb", "qaco")
SHAPES: Final = ("hull", "box", "capsule", "sphere")
PIECES: Final = (4, 16)
"""Of a compound. They come last, because cutting a mesh takes seconds, once per machine."""
LISTING: Final = ("hybrid", "solid-style", "hybrid-qaco")
"""Asked for faces too: a complete one by engine meshes, one by trees, and a search, which lists what it came upon."""


def settings_list(*, shipped: bool = False) -> tuple[Setting, ...]:
    """Everything that is tried, in order: the first ones answer most for least time, the last ones are slow.

    Compounds are among it where the extra ``engines`` is installed; ``shipped``: whether the recording has colliders.
    ``image-space`` is not among them: its two settings would take most of the time.
    """
    ours = ("shipped",) if shipped else ()
    cut = PIECES if find_spec("coacd") else ()
    first, slow = ([Setting(name, AS_IT_COMES, "") for name in names] for names in (FIRST, SLOW))
    return (
        *first,
        *_varied("discrete", "step rate", "rate_hz", EARLY_RATES, " Hz"),
        *slow[:4],
        # What an engine can change: colliders, step rate, mesh resolution.
        *_varied("collider", "step rate", "rate_hz", COLLIDER_RATES, " Hz", shape="mesh"),
        *_varied("collider", "shape", "shape", (*ours, *SHAPES)),
        *_varied("hybrid", "mesh resolution", "cell", CELLS_MM, " mm"),
        *_varied("solid-style", "budget", "budget", TREE_BUDGETS),
        *(Setting(name, ASKED, "faces", faces=True) for name in LISTING),
        *_varied("continuous", "tolerance", "tolerance", TOLERANCES_MM, " mm"),
        *_varied("discrete", "step rate", "rate_hz", RATES, " Hz"),
        *_varied("hybrid-qaco", "samples", "samples", SAMPLES),
        *_varied("hybrid-qaco", "budget", "budget", BUDGETS),
        *_varied("hybrid-qaco", "decide", "decide", ("mesh",)),
        *_varied("rapid-style", "budget", "budget", TREE_BUDGETS),
        *_varied("obb", "budget", "budget", TREE_BUDGETS[2:]),
        *slow[4:],
        *_varied("aabb", "boxes", "mode", ("first",)),
        *_varied("collider", "pieces", "pieces", cut, shape="compound"),
    )


def settings_of(detectors: SpecsLike) -> tuple[Setting, ...]:
    """These detectors instead of the list, under the labels that they were given."""
    return tuple(
        Setting(spec.name, AS_IT_COMES, "", spec.settings, named=spec.label) for spec in parse_detectors(detectors)
    )


def _varied(
    detector: str, axis: str, key: str, values: Sequence[Any], unit: str = "", **fixed: Any
) -> Iterator[Setting]:
    """One parameter of a detector at several values, written in the unit that people read (mm for metres)."""
    for value in values:
        text = value if isinstance(value, str) else f"{value:g}{unit}"
        settings = {**fixed, key: value / 1e3 if unit == " mm" else value}
        yield Setting(detector, axis, text, cell=settings.pop("cell", 0.0), settings=settings)


STEP: Final = "step of trust"
"""The axis of ``TRUST``; a value says what the step adds."""

TRUST: Final[tuple[tuple[str, str, Mapping[str, Any], str], ...]] = (
    ("sphere", "sphere", {}, "a ball in place of each body"),
    ("boxes", "collider", {"shape": "box"}, "boxes in place of balls"),
    ("collider", "collider", {}, "convex hulls, as engines ship"),
    ("colony", "hybrid-qaco", {}, "real faces, as far as a search finds them"),
    ("FCL", "hybrid", {"containment": False}, "every real face, by a widely used engine"),
    ("exact", "exact", {"containment": False}, "degenerate faces and resting ties"),
    ("containment", "exact", {}, "+ a body inside another"),
    ("faces", "exact", {}, "+ which faces meet"),
    ("continuous", "continuous", {}, "+ what happens between frames"),
)


def steps_of_trust() -> tuple[Setting, ...]:
    """From a ball to every moment: what each step adds, and what it costs."""
    return tuple(
        Setting(detector, STEP, adds, settings, faces=label == "faces", named=label)
        for label, detector, settings, adds in TRUST
    )
