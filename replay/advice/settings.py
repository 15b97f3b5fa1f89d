"""Settings to try: one of each family first, then the others of a family, nearest to the front first.

The list is the same on every machine with the same extras; a time limit decides how much of it is tried.
"""

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from math import inf
from typing import Any, Final

from cdcore.detectors.detector_table import detector_row
from replay.detection.detector_spec import DetectorSpec, SpecsLike, parse_detectors, spec_text


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
        """Specification of the detector to run."""
        return DetectorSpec(self.label if self.named else self.detector, self.detector, dict(self.settings))

    @property
    def detector_text(self) -> str:
        """Argument of ``replay run --detectors`` that runs it."""
        return spec_text(self.detector, self.settings)

    @property
    def rate_hz(self) -> float | None:
        """Samples per second; ``None``: every frame."""
        return self.settings.get("rate_hz")

    @property
    def complete(self) -> bool:
        """Whether it says of every frame, by every face, only if bodies meet: nothing is sampled or cut."""
        needs = detector_row(self.detector).complete_with
        cut = any(self.settings.get(key) for key in ("budget", "rate_hz", "epsilon"))
        return needs is not None and not cut and needs.items() <= {"containment": True, **self.settings}.items()


USUAL_STEP_HZ: Final = 50.0
"""The step of an engine in a new project."""

FASTEST_RATE_RATIO: Final = 0.99
"""A rate of so many times the recording's own, or more, sees every frame and is no setting of its own."""


def settings_list(*, frames_hz: float = inf, has_shipped_colliders: bool = False) -> tuple[Setting, ...]:
    """Everything that is tried: the rows of ``settings.toml`` in their order.

    ``frames_hz`` is the rate of the recording, whose frames a faster step cannot tell apart; ``has_shipped_colliders``:
    whether the recording has colliders.
    """
    settings_toml = files("replay.advice").joinpath("settings.toml").read_text("utf-8")
    settings_by_label = {
        setting.label: setting for row in tomllib.loads(settings_toml)["row"] for setting in _of_row(**row)
    }
    available_shapes = {"shipped": has_shipped_colliders}
    return tuple(
        setting
        for setting in settings_by_label.values()
        if available_shapes.get(setting.settings.get("shape", ""), True)
        and (setting.rate_hz or 0.0) < FASTEST_RATE_RATIO * frames_hz
    )


def _of_row(
    label: str,
    detector: str,
    settings: Mapping[str, Any] | None = None,
    line: str = "",
    key: str = "",
    values: Sequence[float] = (),
) -> Iterator[Setting]:
    shared_settings = settings or {}
    if not values:
        yield Setting(label, detector, shared_settings)
    for value in values:
        value_text = f"{value:g}"
        yield Setting(label.format(value_text), detector, {**shared_settings, key: value}, line, value_text)


def settings_of(detectors: SpecsLike) -> tuple[Setting, ...]:
    """These detectors instead of the list, under the labels that they were given."""
    return tuple(Setting(spec.label, spec.name, spec.settings, named=True) for spec in parse_detectors(detectors))


def next_to_front(untried: Sequence[Setting], all_settings: Sequence[Setting], front: Sequence[str]) -> list[Setting]:
    """The untried settings, those first whose line has a neighbour on the front; of equals the earlier in the list."""
    labels_of_line: dict[str, list[str]] = {"": []}
    for setting in sorted(all_settings, key=lambda setting: float(setting.value or 0.0)):
        if setting.line:
            labels_of_line.setdefault(setting.line, []).append(setting.label)

    def distance(setting: Setting) -> float:
        labels = labels_of_line[setting.line]
        steps = (abs(labels.index(setting.label) - labels.index(label)) for label in front if label in labels)
        return min(steps, default=inf)

    return sorted(untried, key=distance)
