"""Specifications of detectors, written on a command line or in Python.

``hybrid`` | ``discrete[rate_hz=22.5]`` | ``slow=discrete[rate_hz=22.5]``, several separated by commas. The names that
the tool prints in its rankings, ``hull50``, ``mesh50``, ``shipped50``, ``paper``, are accepted as well.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import isfinite
from typing import Any, Final, TypeAlias, TypeGuard, cast

from replay.errors import DetectorSpecError

SpecLike: TypeAlias = "str | tuple[str, Mapping[str, Any]] | DetectorSpec"
SpecsLike: TypeAlias = "SpecLike | Iterable[SpecLike] | Mapping[str, SpecLike]"

_LABEL = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")
_SPEC_PATTERN = re.compile(r"(?:(?P<label>[^=\[\]]+)=)?(?P<name>[^=\[\]]+)(?:\[(?P<settings>[^\[\]]*)\])?")
_UNSAFE_IN_LABEL = re.compile(r"[^A-Za-z0-9._-]+")
_COMMA_OUTSIDE = re.compile(r",(?![^\[]*\])")
_LITERAL_VALUES = {"true": True, "false": False, "none": None}
MOST_RELEASE_M: Final = 1.0
"""Metres of the largest distance up to which a contact may last."""

_SPEC_SYNTAX = "write name, name[setting=value,...] or label=name[...]"

SCREEN_NAMES: Final[Mapping[str, tuple[str, Mapping[str, Any]]]] = {
    "hull": ("collider", {"shape": "hull"}),
    "shipped": ("collider", {"shape": "shipped"}),
    "mesh": ("discrete", {}),
    "paper": ("hybrid-qaco", {}),
}
"""Name on the screen -> the detector behind it and its settings. All but ``paper`` take a rate in hertz: ``hull50``."""

_SCREEN_NAME = re.compile(r"(?P<base>hull|shipped|mesh)(?P<rate>\d+(?:\.\d+)?)?|paper")

RELEASE_SETTING: Final = "release_m"
"""Setting that every detector takes: metres up to which a contact lasts, once it has begun."""

TRUSTED_DETECTOR: Final = "exact"
"""The oracle unless another is asked for, and the detector that effects name for instants; where it does not run, the
oracle or the first detector replaces it."""


@dataclass(frozen=True)
class DetectorSpec:
    """One detector to run.

    Parameters
    ----------
    label : what the run calls it; unique in a run; letters, digits, ``.``, ``_``, ``-`` only, because it becomes part
        of entity paths and column names.
    name : row of the table of detectors.
    settings : fields of that detector's settings.
    release : metres between the shapes of two bodies up to which a contact lasts, once it has begun; 0: none.
    """

    label: str
    name: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    release: float = 0.0

    def __post_init__(self) -> None:
        if not _LABEL.fullmatch(self.label):
            raise DetectorSpecError(
                f"{self.label!r} cannot be a label; use letters, digits, '.', '_' and '-', a letter or digit first"
            )
        is_number = isinstance(self.release, (int, float)) and not isinstance(self.release, bool)
        if not (is_number and isfinite(self.release) and 0.0 <= self.release <= MOST_RELEASE_M):
            raise DetectorSpecError(
                f"{RELEASE_SETTING}={self.release} is not allowed; give metres from 0 to {MOST_RELEASE_M:g}"
            )

    def __str__(self) -> str:
        return f"{self.label}={self.text}"

    @property
    def text(self) -> str:
        """The detector with its settings, as a command line asks for it, without its label."""
        return spec_text(self.name, {**self.settings, **({RELEASE_SETTING: self.release} if self.release else {})})


def spec_text(name: str, settings: Mapping[str, Any]) -> str:
    """``discrete[rate_hz=22.5]``: how a command line asks for a detector."""
    # An empty text is the default of its setting, and cannot be written.
    settings_text = ",".join(f"{key}={_value_text(value)}" for key, value in settings.items() if value != "")
    return f"{name}[{settings_text}]" if settings_text else name


def parse_detector(spec_like: SpecLike, label: str | None = None) -> DetectorSpec:
    """One detector from text, from ``(name, settings)``, or as it is.

    Raises
    ------
    DetectorSpecError
        Text of another form.

    Examples
    --------
    >>> parse_detector("slow=discrete[rate_hz=22.5]")
    DetectorSpec(label='slow', name='discrete', settings={'rate_hz': 22.5}, release=0.0)
    """
    spec = _parse_text(spec_like.strip()) if isinstance(spec_like, str) else spec_like
    if isinstance(spec, DetectorSpec):
        return spec if label is None else replace(spec, label=label)
    if _is_pair(spec):
        return _named_spec(*spec, label=label)
    raise DetectorSpecError(f"{spec_like!r} names no detector; {_SPEC_SYNTAX}, or give (name, settings)")


def parse_detectors(specs_like: SpecsLike) -> tuple[DetectorSpec, ...]:
    """Several detectors from comma-separated text, a sequence, or a mapping from label to detector.

    Raises
    ------
    DetectorSpecError
        Text of another form, or two detectors of one label.
    """
    if isinstance(specs_like, Mapping):
        specs = [parse_detector(spec_like, label) for label, spec_like in specs_like.items()]
    else:
        is_single = isinstance(specs_like, str | DetectorSpec) or _is_pair(specs_like)
        given_specs = cast("Iterable[SpecLike]", [specs_like] if is_single else specs_like)
        specs = [parse_detector(spec) for given_spec in given_specs for spec in _single_specs(given_spec)]
    labels = [spec.label for spec in specs]
    repeated_label = next((label for label in labels if labels.count(label) > 1), None)
    if repeated_label is not None:
        raise DetectorSpecError(
            f"two detectors are called {repeated_label!r}; give each a label of its own: label=name[...]"
        )
    return tuple(specs)


def split_specs(specs_text: str) -> list[str]:
    """The specs between the commas of a text; commas within brackets separate settings and stay."""
    return [spec for spec in _COMMA_OUTSIDE.split(specs_text) if spec.strip()]


def _single_specs(specs_like: SpecLike) -> Sequence[SpecLike]:
    return split_specs(specs_like) if isinstance(specs_like, str) else [specs_like]


def _is_pair(candidate: object) -> TypeGuard[tuple[str, Mapping[str, Any]]]:
    return (
        isinstance(candidate, tuple)
        and len(candidate) == 2
        and isinstance(candidate[0], str)
        and isinstance(candidate[1], Mapping)
    )


def _parse_text(detector_text: str) -> DetectorSpec:
    match = _SPEC_PATTERN.fullmatch(detector_text)
    if match is None:
        raise DetectorSpecError(f"{detector_text!r} names no detector; {_SPEC_SYNTAX}")
    settings = dict(
        _parsed_setting(detector_text, setting) for setting in (match["settings"] or "").split(",") if setting.strip()
    )
    label = match["label"].strip() if match["label"] else None
    return _named_spec(match["name"].strip(), settings, label=label)


def _named_spec(name: str, settings: Mapping[str, Any], *, label: str | None) -> DetectorSpec:
    """The detector of a name, a name on the screen included; without a label its name and settings are the label."""
    label = label or _default_label(name, settings)
    release_distance = settings.get(RELEASE_SETTING, 0.0)
    settings = {key: value for key, value in settings.items() if key != RELEASE_SETTING}
    screen_name = _SCREEN_NAME.fullmatch(name)
    if screen_name is None:
        return DetectorSpec(label, name, settings, release_distance)
    table_row, implied_settings = SCREEN_NAMES[screen_name["base"] or name]
    rate_setting = {"rate_hz": _parsed_value(screen_name["rate"])} if screen_name["rate"] else {}
    contradicted_settings = [
        key for key, value in {**implied_settings, **rate_setting}.items() if settings.get(key, value) != value
    ]
    if contradicted_settings:
        raise DetectorSpecError(
            f"{name} means {spec_text(table_row, {**implied_settings, **rate_setting})}, which contradicts "
            f"{contradicted_settings[0]}="
            f"{_value_text(settings[contradicted_settings[0]])}; write "
            f"{spec_text(table_row, {**implied_settings, **rate_setting, **settings})}"
        )
    return DetectorSpec(label, table_row, {**implied_settings, **rate_setting, **settings}, release_distance)


def _parsed_setting(setting_text: str, setting: str) -> tuple[str, Any]:
    key, equals, value = setting.partition("=")
    if not equals or not key.strip().isidentifier() or not value.strip():
        raise DetectorSpecError(f"{setting.strip()!r} in {setting_text!r} is no setting; {_SPEC_SYNTAX}")
    return key.strip(), _parsed_value(value.strip())


def _parsed_value(text: str) -> Any:
    if text.lower() in _LITERAL_VALUES:
        return _LITERAL_VALUES[text.lower()]
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


def _value_text(setting_value: Any) -> str:
    return (
        str(setting_value).lower() if setting_value is None or isinstance(setting_value, bool) else str(setting_value)
    )


def _default_label(name: str, settings: Mapping[str, Any]) -> str:
    """``discrete[rate_hz=22.5]`` is called ``discrete-22.5``, ``package.module:Class`` is called ``Class``."""
    tokens = [name.rpartition(":")[2], *(_value_text(value) for value in settings.values())]
    return "-".join(_UNSAFE_IN_LABEL.sub("_", word).lstrip("._-") or "x" for word in tokens)
