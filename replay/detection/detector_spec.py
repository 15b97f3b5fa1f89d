"""Which detectors to run, written on a command line or in Python.

``hybrid`` | ``discrete[rate_hz=22.5]`` | ``slow=discrete[rate_hz=22.5]``, several separated by commas.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final, TypeAlias, TypeGuard, cast

from replay.errors import DetectorSpecError

SpecLike: TypeAlias = "str | tuple[str, Mapping[str, Any]] | DetectorSpec"
SpecsLike: TypeAlias = "SpecLike | Iterable[SpecLike] | Mapping[str, SpecLike]"

_LABEL = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")
_FORM = re.compile(r"(?:(?P<label>[^=\[\]]+)=)?(?P<name>[^=\[\]]+)(?:\[(?P<settings>[^\[\]]*)\])?")
_UNSAFE = re.compile(r"[^A-Za-z0-9._-]+")
_COMMA_OUTSIDE = re.compile(r",(?![^\[]*\])")
_WORDS = {"true": True, "false": False, "none": None}
_HOW = "write name, name[setting=value,...] or label=name[...]"

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
    """

    label: str
    name: str
    settings: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not _LABEL.fullmatch(self.label):
            raise DetectorSpecError(
                f"{self.label!r} cannot be a label; use letters, digits, '.', '_' and '-', a letter or digit first"
            )

    def __str__(self) -> str:
        return f"{self.label}={asked_as(self.name, self.settings)}"


def asked_as(name: str, settings: Mapping[str, Any]) -> str:
    """``discrete[rate_hz=22.5]``: how a command line asks for a detector."""
    words = ",".join(f"{key}={_written(value)}" for key, value in settings.items())
    return f"{name}[{words}]" if words else name


def parse_detector(given: SpecLike, label: str | None = None) -> DetectorSpec:
    """One detector from text, from ``(name, settings)``, or as it is.

    Raises
    ------
    DetectorSpecError
        Text of another form.

    Examples
    --------
    >>> parse_detector("slow=discrete[rate_hz=22.5]")
    DetectorSpec(label='slow', name='discrete', settings={'rate_hz': 22.5})
    """
    spec = _parse_text(given.strip()) if isinstance(given, str) else given
    if isinstance(spec, DetectorSpec):
        return spec if label is None else replace(spec, label=label)
    if _is_pair(spec):
        name, settings = spec
        return DetectorSpec(label or _default_label(name, settings), name, dict(settings))
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
        alone = isinstance(given, str | DetectorSpec) or _is_pair(given)
        parts = cast("Iterable[SpecLike]", [given] if alone else given)
        specs = [parse_detector(spec) for part in parts for spec in _apart(part)]
    labels = [spec.label for spec in specs]
    twice = next((label for label in labels if labels.count(label) > 1), None)
    if twice is not None:
        raise DetectorSpecError(f"two detectors are called {twice!r}; give each a label of its own: label=name[...]")
    return tuple(specs)


def _apart(part: SpecLike) -> list[SpecLike]:
    """What stands between the commas of a text."""
    return [text for text in _COMMA_OUTSIDE.split(part) if text.strip()] if isinstance(part, str) else [part]


def _is_pair(given: object) -> TypeGuard[tuple[str, Mapping[str, Any]]]:
    return isinstance(given, tuple) and len(given) == 2 and isinstance(given[0], str) and isinstance(given[1], Mapping)


def _parse_text(text: str) -> DetectorSpec:
    match = _FORM.fullmatch(text)
    if match is None:
        raise DetectorSpecError(f"{text!r} names no detector; {_HOW}")
    name = match["name"].strip()
    settings = dict(_setting(text, part) for part in (match["settings"] or "").split(",") if part.strip())
    label = match["label"].strip() if match["label"] else _default_label(name, settings)
    return DetectorSpec(label, name, settings)


def _setting(text: str, part: str) -> tuple[str, Any]:
    key, equals, value = part.partition("=")
    if not equals or not key.strip().isidentifier() or not value.strip():
        raise DetectorSpecError(f"{part.strip()!r} in {text!r} is no setting; {_HOW}")
    return key.strip(), _value(value.strip())


def _value(text: str) -> Any:
    if text.lower() in _WORDS:
        return _WORDS[text.lower()]
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
    words = [name.rpartition(":")[2], *(_written(value) for value in settings.values())]
    return "-".join(_UNSAFE.sub("_", word).lstrip("._-") or "x" for word in words)
