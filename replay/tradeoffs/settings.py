"""What is tried: one setting of each family first, then the others of a family, nearest to the front first.

The list is the same on every machine with the same extras; a time limit decides how much of it is tried.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.util import find_spec
from typing import Any, Final

import numpy as np

from cdcore.numerics import FloatArray
from replay.detection.detector_spec import DetectorSpec, SpecsLike, parse_detectors


@dataclass(frozen=True)
class Setting:
    """One row: a detector with its settings, under a label in plain words.

    ``line`` names the settings that differ in one value only, and ``value`` is that one; ``named``: whether somebody
    chose the label.
    """

    label: str
    detector: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    line: str = ""
    value: str = ""
    named: bool = False

    @property
    def spec(self) -> DetectorSpec:
        """What to run."""
        return DetectorSpec(self.label if self.named else self.detector, self.detector, dict(self.settings))

    @property
    def asked(self) -> str:
        """What ``replay run --detectors`` takes to run it."""
        return str(self.spec).partition("=")[2]

    @property
    def rate_hz(self) -> float | None:
        """Samples per second; ``None``: every frame."""
        return self.settings.get("rate_hz")

    @property
    def complete(self) -> bool:
        """Whether it says of every frame, by every face, only if bodies meet: nothing is sampled or cut."""
        needs = COMPLETE.get(self.detector)
        cut = any(self.settings.get(key) for key in ("budget", "rate_hz", "epsilon"))
        return needs is not None and not cut and needs.items() <= {"containment": True, **self.settings}.items()


COMPLETE: Final[Mapping[str, Mapping[str, Any]]] = {
    name: {"containment": True}
    for name in ("exact", "hybrid", "discrete", "static", "solid-style", "rapid-style", "obb", "aabb")
} | {"collider": {"shape": "mesh"}, "hybrid-qaco": {"decide": "mesh", "containment": True}}
"""Detectors that can miss nothing at a frame, and the settings which that takes."""

RATES: Final = (2, 5, 10, 15, 22.5, 30, 45, 50, 60, 72, 90, 120)
"""Samples per second: from a slow poll to what engines and headsets do."""

SAMPLES: Final = (30, 120, 480, 1920)
"""Faces of each body that the search of the paper samples."""

BUDGETS: Final = (30, 120, 480, 1920, 7680)
"""Evaluations that this search may spend on a pair and frame."""

TREE_BUDGETS: Final = (30, 100, 300, 1000, 3000)
PIECES: Final = (4, 16)
"""Of a compound. Cutting a mesh takes seconds, once per machine."""

FASTEST: Final = 0.99
"""A rate of so many times the recording's own, or more, sees every frame and is no setting of its own."""


def settings_list(*, frames_hz: float = float("inf"), shipped: bool = False) -> tuple[Setting, ...]:
    """Everything that is tried: one setting of each family, then the lines.

    ``frames_hz`` is the rate of the recording, whose frames a faster step cannot tell apart; ``shipped``: whether the
    recording has colliders. Compounds are among the list where the extra ``engines`` is installed.
    """
    rates = [rate for rate in RATES if rate < FASTEST * frames_hz]
    meshes = [*_line("meshes at a step rate", "meshes at {} Hz", "collider", "rate_hz", rates, shape="mesh")]
    hulls = [*_line("hulls at a step rate", "hulls at {} Hz", "collider", "rate_hz", rates, shape="hull")]
    recorded = [Setting("colliders of recording", "collider", {"shape": "shipped"})] if shipped else []
    pieces = [
        Setting(f"{most} convex pieces", "collider", {"shape": "compound", "pieces": most}, "convex pieces", str(most))
        for most in PIECES
        if find_spec("coacd")
    ]
    first = [
        Setting("exact", "exact"),
        *[setting for setting in (*meshes, *hulls) if setting.rate_hz == USUAL_HZ],
        Setting("paper", "hybrid-qaco"),
        *[setting for setting in meshes if setting.rate_hz in EARLY],
        *recorded,
        Setting("hulls, every frame", "collider", {"shape": "hull"}),
        *(Setting(f"{words}, every frame", "collider", {"shape": shape}) for shape, words in SIMPLE.items()),
        Setting("FCL", "hybrid"),
        *(Setting(name, name) for name in ("solid-style", "discrete", "static", "rapid-style", "aabb")),
    ]
    rest = [
        *meshes,
        *hulls,
        *pieces,
        *_line("paper, samples", "paper, {} samples", "hybrid-qaco", "samples", SAMPLES),
        *_line("paper, evaluations", "paper, {} evaluations", "hybrid-qaco", "budget", BUDGETS),
        Setting("paper, deciding by meshes", "hybrid-qaco", {"decide": "mesh"}),
        *_line("solid-style, tests", "solid-style, {} tests", "solid-style", "budget", TREE_BUDGETS),
        *_line("rapid-style, tests", "rapid-style, {} tests", "rapid-style", "budget", TREE_BUDGETS),
        Setting("obb", "obb"),
        Setting("qaco", "qaco"),
    ]
    return tuple({setting.label: setting for setting in (*first, *rest)}.values())


USUAL_HZ: Final = 50.0
"""The step of an engine in a new project."""

EARLY: Final = (10.0, 22.5)
"""Rates of meshes that are tried early: they say what sampling less often saves."""

SIMPLE: Final = {"box": "boxes", "capsule": "capsules", "sphere": "spheres"}
"""Simple shape of a collider -> its word."""


def rate_of(times: FloatArray) -> float:
    """Frames per second of a recording with these times (T,) in seconds, by the median step; infinite of one frame."""
    steps = np.diff(times)
    return 1.0 / float(np.median(steps)) if len(steps) else float("inf")


def settings_of(detectors: SpecsLike) -> tuple[Setting, ...]:
    """These detectors instead of the list, under the labels that they were given."""
    return tuple(Setting(spec.label, spec.name, spec.settings, named=True) for spec in parse_detectors(detectors))


def next_to_front(untried: Sequence[Setting], every: Sequence[Setting], front: Sequence[str]) -> list[Setting]:
    """The untried settings, those first whose line has a neighbour on the front; of equals the earlier in the list."""
    lines: dict[str, list[str]] = {}
    for setting in sorted(every, key=_place):
        lines.setdefault(setting.line, []).append(setting.label)
    near = set(front)

    def distance(setting: Setting) -> float:
        labels = lines[setting.line] if setting.line else []
        place = {label: number for number, label in enumerate(labels)}
        return min(
            (abs(place[setting.label] - place[label]) for label in labels if label in near), default=float("inf")
        )

    return sorted(untried, key=distance)


def _place(setting: Setting) -> float:
    """The place of a setting on its line."""
    return float(setting.value) if setting.value else 0.0


def _line(line: str, label: str, detector: str, key: str, values: Sequence[Any], **fixed: Any) -> Iterator[Setting]:
    """One parameter of a detector at several values, which ascend."""
    for value in values:
        text = f"{value:g}"
        yield Setting(label.format(text), detector, {**fixed, key: value}, line, text)
