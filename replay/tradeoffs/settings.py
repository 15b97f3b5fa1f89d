"""The fixed list of what is tried: every algorithm, and every axis on which accuracy costs, cheap and telling first.

The list is the same on every machine and in every run; a time limit cuts its tail.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from replay.base.constants import HEADSET_HZ
from replay.detection.detector_spec import DetectorSpec


@dataclass(frozen=True)
class Setting:
    """One point of the picture: a detector, what is turned (``axis``, such as ``step rate``) and how far (``value``).

    ``settings`` are the detector's; ``cell`` metres of the grid that makes meshes coarser, 0: as recorded; ``faces``
    says whether every face pair is listed; ``tail`` is tried once, when all others have had their repeats.
    """

    detector: str
    axis: str
    value: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    cell: float = 0.0
    faces: bool = False
    tail: bool = False

    @property
    def label(self) -> str:
        """Unique in the list: ``hybrid-qaco samples 240``; ``hybrid faces`` needs no axis to be understood."""
        if self.axis == AS_IT_COMES:
            return self.detector
        return " ".join((self.detector, *([] if self.axis == ASKED else [self.axis]), self.value))

    @property
    def line(self) -> str:
        """Points of one line in the picture: one algorithm, one axis."""
        return self.detector if self.axis == AS_IT_COMES else f"{self.detector}, {self.axis}"

    @property
    def spec(self) -> DetectorSpec:
        """What to run."""
        return DetectorSpec(self.detector, self.detector, dict(self.settings))


AS_IT_COMES: Final = "as it comes"

ASKED: Final = "booleans or faces"
"""The axis of what is asked: only whether two bodies meet, or every face pair that does."""

EARLY_RATES: Final = (22.5, 45.0)
RATES: Final = (HEADSET_HZ, 60.0, 72.0, 10.0, 5.0, 2.0)
"""Looks per second: from a slow poll to the headset's own rate; 45 and more are what engines ship. Frame by frame is
slow to time: two come early, for advice about a live loop in 20 seconds, the others late."""

COLLIDER_RATES: Final = (4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 15.0, 22.5, 45.0)
"""Denser where most is lost: this is the cheap end of the front."""

CELLS_MM: Final = (1.0, 2.0, 5.0, 10.0)
SAMPLES: Final = (30, 120, 480, 1920, "auto")
"""Faces of each body that a search samples."""

BUDGETS: Final = (30, 120, 480, 1920, 7680)
"""Evaluations that a search may spend on a pair and frame."""

TREE_BUDGETS: Final = (30, 100, 300, 1000, 3000)
TOLERANCES_MM: Final = (1.0, 0.1, 0.01)
PLAIN: Final = ("hybrid", "exact", "solid-style", "sphere", "static", "discrete", "hybrid-qaco", "rapid-style", "obb")
SHAPES: Final = ("hull", "box", "capsule", "sphere")
LISTING: Final = ("hybrid", "solid-style", "hybrid-qaco")
"""Asked for both: a complete one by engine meshes, one by trees, and a search, which lists what it came upon."""


def settings_list() -> tuple[Setting, ...]:
    """Everything that is tried, in order: the first ones answer most for least time, the last ones are slow."""
    plain = (Setting(name, AS_IT_COMES, "") for name in PLAIN)
    # Tried once, after the repeats of all others, where the time limit leaves room.
    tail = (Setting("image-space", "resolution", str(size), {"resolution": size}, tail=True) for size in (4, 8))
    return (
        *plain,
        *_varied("discrete", "step rate", "rate_hz", EARLY_RATES, " Hz"),
        # What an engine can change: colliders, step rate, mesh resolution.
        *_varied("collider", "step rate", "rate_hz", COLLIDER_RATES, " Hz", shape="mesh"),
        *_varied("collider", "shape", "shape", SHAPES),
        *_varied("hybrid", "mesh resolution", "cell", CELLS_MM, " mm"),
        *_varied("solid-style", "budget", "budget", TREE_BUDGETS),
        *(Setting(name, ASKED, what, faces=what == "faces") for name in LISTING for what in ("booleans", "faces")),
        *_varied("continuous", "tolerance", "tolerance", TOLERANCES_MM, " mm"),
        *_varied("discrete", "step rate", "rate_hz", RATES, " Hz"),
        *_varied("hybrid-qaco", "samples", "samples", SAMPLES),
        *_varied("hybrid-qaco", "budget", "budget", BUDGETS),
        *_varied("hybrid-qaco", "decide", "decide", ("mesh",)),
        *_varied("rapid-style", "budget", "budget", TREE_BUDGETS),
        *_varied("obb", "budget", "budget", TREE_BUDGETS[2:]),
        Setting("aabb", AS_IT_COMES, ""),
        *_varied("aabb", "boxes", "mode", ("first",)),
        Setting("qaco", AS_IT_COMES, ""),
        *tail,
    )


def _varied(
    detector: str, axis: str, key: str, values: Sequence[Any], unit: str = "", **fixed: Any
) -> Iterator[Setting]:
    """One parameter of a detector at several values, written in the unit that people read (mm for metres)."""
    for value in values:
        text = value if isinstance(value, str) else f"{value:g}{unit}"
        settings = {**fixed, key: value / 1e3 if unit == " mm" else value}
        yield Setting(detector, axis, text, cell=settings.pop("cell", 0.0), settings=settings)
