"""The fixed list of what is tried: every algorithm, and every axis on which accuracy costs, cheap and telling first.

The list is the same on every machine and in every run; a time limit cuts its tail.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from replay.detector_spec import DetectorSpec


@dataclass(frozen=True)
class Setting:
    """One point of the picture.

    Parameters
    ----------
    detector : row of the table of detectors.
    axis : what is turned: ``as it comes``, ``step rate``, ``shape``, ``mesh resolution``, ``tolerance``,
        ``samples``, ``budget``, ``decide``, ``booleans or faces``, ``resolution``, or ``boxes``.
    value : how far, as people write it.
    settings : fields of the detector's settings.
    cell : metres of the grid that makes the meshes coarser; 0: as recorded.
    faces : whether every face pair is listed, not only the yes or no.
    tail : tried once, when all others have had their repeats.
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
RATES: Final = (90.0, 60.0, 72.0, 10.0, 5.0, 2.0)
"""Looks per second: from a slow poll to the headset's own rate; 45 and more are what engines ship. Frame by frame is
slow to time: two come early, for advice about a live loop in 20 seconds, the others late."""

COLLIDER_RATES: Final = (4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 15.0, 22.5, 45.0)
"""Denser where most is lost: this is the cheap end of the front."""

CELLS_MM: Final = (1.0, 2.0, 5.0, 10.0)
SAMPLES: Final = (30, 120, 480, 1920, "auto")
"""Faces of each body that a search looks at."""

BUDGETS: Final = (30, 120, 480, 1920, 7680)
"""Evaluations that a search may spend on a pair and frame."""

TREE_BUDGETS: Final = (30, 100, 300, 1000, 3000)
TOLERANCES_MM: Final = (1.0, 0.1, 0.01)
PLAIN: Final = ("hybrid", "exact", "solid-style", "sphere", "static", "discrete", "hybrid-qaco", "rapid-style", "obb")
SHAPES: Final = ("hull", "box", "capsule", "sphere")
LISTING: Final = ("hybrid", "solid-style", "hybrid-qaco")
"""Asked for both: a complete one by engine meshes, one by trees, and a search, which lists what it came upon."""


def settings_list() -> tuple[Setting, ...]:
    """Everything that is tried, in order: the head answers most for least, the tail is slow."""
    plain = (Setting(name, AS_IT_COMES, "") for name in PLAIN)
    return (*plain, *_live(EARLY_RATES), *_shipped(), *_asked(), *_live(RATES), *_searches(), *_slow(), *_tail())


def _shipped() -> Iterator[Setting]:
    """What an engine would turn: its colliders, how often they are looked at, its meshes; a tree's budget."""
    for rate in COLLIDER_RATES:
        yield Setting("collider", "step rate", f"{rate:g} Hz", {"shape": "mesh", "rate_hz": rate})
    for shape in SHAPES:
        yield Setting("collider", "shape", shape, {"shape": shape})
    for cell in CELLS_MM:
        yield Setting("hybrid", "mesh resolution", f"{cell:g} mm", cell=cell / 1e3)
    for budget in TREE_BUDGETS:
        yield Setting("solid-style", "budget", str(budget), {"budget": budget})


def _asked() -> Iterator[Setting]:
    """Faces too; and contacts between frames."""
    for detector in LISTING:
        yield Setting(detector, ASKED, "booleans")
        yield Setting(detector, ASKED, "faces", faces=True)
    for tolerance in TOLERANCES_MM:
        yield Setting("continuous", "tolerance", f"{tolerance:g} mm", {"tolerance": tolerance / 1e3})


def _live(rates: Sequence[float]) -> Iterator[Setting]:
    """Frame by frame, at the rate of a headset and below."""
    for rate in rates:
        yield Setting("discrete", "step rate", f"{rate:g} Hz", {"rate_hz": rate})


def _searches() -> Iterator[Setting]:
    for samples in SAMPLES:
        yield Setting("hybrid-qaco", "samples", str(samples), {"samples": samples})
    for budget in BUDGETS:
        yield Setting("hybrid-qaco", "budget", str(budget), {"budget": budget})
    yield Setting("hybrid-qaco", "decide", "mesh", {"decide": "mesh"})


def _slow() -> Iterator[Setting]:
    for budget in TREE_BUDGETS:
        yield Setting("rapid-style", "budget", str(budget), {"budget": budget})
    for budget in TREE_BUDGETS[2:]:
        yield Setting("obb", "budget", str(budget), {"budget": budget})
    yield Setting("aabb", AS_IT_COMES, "")
    yield Setting("aabb", "boxes", "first", {"mode": "first"})
    yield Setting("qaco", AS_IT_COMES, "")


def _tail() -> Iterator[Setting]:
    """Tried once, after the repeats of all others, where the time limit leaves room."""
    for resolution in (4, 8):
        yield Setting("image-space", "resolution", str(resolution), {"resolution": resolution}, tail=True)
