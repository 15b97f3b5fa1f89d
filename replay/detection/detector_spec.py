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
_FORM = re.compile(r"(?:(?P<label>[^=\[\]]+)=)?(?P<name>[^=\[\]]+)(?:\[(?P<settings>[^\[\]]*)\])?")
_UNSAFE = re.compile(r"[^A-Za-z0-9._-]+")
_COMMA_OUTSIDE = re.compile(r",(?![^\[]*\])")
_LITERALS = {"true": True, "false": False, "none": None}
MOST_RELEASE: Final = 1.0
"""Metres of the largest distance up to which a contact may last."""

_HOW = "write name, name[setting=value,...] or label=name[...]"

SCREEN_NAMES: Final[Mapping[str, tuple[str, Mapping[str, Any]]]] = {
    "hull": ("collider", {"shape": "hull"}),
    "shipped": ("collider", {"shape": "shipped"}),
    "mesh": ("discrete", {}),
    "paper": ("hybrid-qaco", {}),
}
"""Name on the screen -> the detector behind it and its settings. All but ``paper`` take a rate in hertz: ``hull50``."""

_SCREEN_NAME = re.compile(r"(?P<base>hull|shipped|mesh)(?P<rate>\d+(?:\.\d+)?)?|paper")

RELEASE: Final = "release_m"
"""Setting that every detector takes: metres up to which a contact lasts, once it has begun."""

TRUSTED: Final = "exact"
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
        if not (is_number and isfinite(self.release) and 0.0 <= self.release <= MOST_RELEASE):
            raise DetectorSpecError(f"{RELEASE}={self.release} is not allowed; give metres from 0 to {MOST_RELEASE:g}")

    def __str__(self) -> str:
        return f"{self.label}={self.text}"

    @property
    def text(self) -> str:
        """The detector with its settings, as a command line asks for it, without its label."""
        return spec_text(self.name, {**self.settings, **({RELEASE: self.release} if self.release else {})})


def spec_text(name: str, settings: Mapping[str, Any]) -> str:
    """``discrete[rate_hz=22.5]``: how a command line asks for a detector."""
    # An empty text is the default of its setting, and cannot be written.
    text = ",".join(f"{key}={_written(value)}" for key, value in settings.items() if value != "")
    return f"{name}[{text}]" if text else name


def parse_detector(given: SpecLike, label: str | None = None) -> DetectorSpec:
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
    spec = _parse_text(given.strip()) if isinstance(given, str) else given
    if isinstance(spec, DetectorSpec):
        return spec if label is None else replace(spec, label=label)
    if _is_pair(spec):
        return _named_spec(*spec, label=label)
    raise DetectorSpecError(f"{given!r} names no detector; {_HOW}, or give (name, settings)")


def parse_detectors(given: SpecsLike) -> tuple[DetectorSpec, ...]:
    """Several detectors from comma-separated text, a sequence, or a mapping from label to detector.

    Raises
    ------
    DetectorSpecError
        Text of another form, or two detectors of one label.
    """
    if isinstance(given, Mapping):
        specs = [parse_detector(value, label) for label, value in given.items()]
    else:
        is_single = isinstance(given, str | DetectorSpec) or _is_pair(given)
        given_specs = cast("Iterable[SpecLike]", [given] if is_single else given)
        specs = [parse_detector(spec) for given_spec in given_specs for spec in _single_specs(given_spec)]
    labels = [spec.label for spec in specs]
    twice = next((label for label in labels if labels.count(label) > 1), None)
    if twice is not None:
        raise DetectorSpecError(f"two detectors are called {twice!r}; give each a label of its own: label=name[...]")
    return tuple(specs)


def split_specs(text: str) -> list[str]:
    """The specs between the commas of a text; commas within brackets separate settings and stay."""
    return [spec for spec in _COMMA_OUTSIDE.split(text) if spec.strip()]


def _single_specs(given: SpecLike) -> Sequence[SpecLike]:
    return split_specs(given) if isinstance(given, str) else [given]


def _is_pair(given: object) -> TypeGuard[tuple[str, Mapping[str, Any]]]:
    return isinstance(given, tuple) and len(given) == 2 and isinstance(given[0], str) and isinstance(given[1], Mapping)


def _parse_text(text: str) -> DetectorSpec:
    match = _FORM.fullmatch(text)
    if match is None:
        raise DetectorSpecError(f"{text!r} names no detector; {_HOW}")
    settings = dict(
        _parsed_setting(text, setting) for setting in (match["settings"] or "").split(",") if setting.strip()
    )
    label = match["label"].strip() if match["label"] else None
    return _named_spec(match["name"].strip(), settings, label=label)


def _named_spec(name: str, settings: Mapping[str, Any], *, label: str | None) -> DetectorSpec:
    """The detector of a name, a name on the screen included; without a label its name and settings are the label."""
    label = label or _default_label(name, settings)
    release = settings.get(RELEASE, 0.0)
    settings = {key: value for key, value in settings.items() if key != RELEASE}
    screen_name = _SCREEN_NAME.fullmatch(name)
    if screen_name is None:
        return DetectorSpec(label, name, settings, release)
    row, implied = SCREEN_NAMES[screen_name["base"] or name]
    rate = {"rate_hz": _value(screen_name["rate"])} if screen_name["rate"] else {}
    contradicted = [key for key, value in {**implied, **rate}.items() if settings.get(key, value) != value]
    if contradicted:
        raise DetectorSpecError(
            f"{name} means {spec_text(row, {**implied, **rate})}, which contradicts {contradicted[0]}="
            f"{_written(settings[contradicted[0]])}; write {spec_text(row, {**implied, **rate, **settings})}"
        )
    return DetectorSpec(label, row, {**implied, **rate, **settings}, release)


def _parsed_setting(text: str, setting: str) -> tuple[str, Any]:
    key, equals, value = setting.partition("=")
    if not equals or not key.strip().isidentifier() or not value.strip():
        raise DetectorSpecError(f"{setting.strip()!r} in {text!r} is no setting; {_HOW}")
    return key.strip(), _value(value.strip())


def _value(text: str) -> Any:
    if text.lower() in _LITERALS:
        return _LITERALS[text.lower()]
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


def _written(value: Any) -> str:
    return str(value).lower() if value is None or isinstance(value, bool) else str(value)


def _default_label(name: str, settings: Mapping[str, Any]) -> str:
    """``discrete[rate_hz=22.5]`` is called ``discrete-22.5``, ``package.module:Class`` is called ``Class``."""
    tokens = [name.rpartition(":")[2], *(_written(value) for value in settings.values())]
    return "-".join(_UNSAFE.sub("_", word).lstrip("._-") or "x" for word in tokens)
