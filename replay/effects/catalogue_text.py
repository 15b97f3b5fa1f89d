"""The keys of every effect as text: what a scene may declare, with units, defaults and a value to copy."""

import json
import textwrap
from collections.abc import Iterator, Mapping
from typing import Any, Final

from replay.effects import CATALOGUE
from replay.effects.declaring import Field, field_of
from replay.errors import EffectError
from sessions.input_files import nearest

LINE_COLUMNS: Final = 80

EXAMPLE_VALUES: Final[Mapping[str, Any]] = {
    "body": "flask",
    "bodies": ["flask"],
    "pairs": ["tag:hand", "tag:glass"],
    "vector": [0.0, 0.0, 1.0],
    "colour": "blue",
}
"""Kind of a field -> a value to copy, where its own row has none."""


def fields_of(kind: str) -> dict[str, Field]:
    """Key -> field of an effect of the catalogue. Raises EffectError: there is no such effect."""
    if kind not in CATALOGUE:
        raise EffectError(f"no effect {kind!r}{nearest(kind, CATALOGUE)}")
    return {key: field_of(field_table) for key, field_table in CATALOGUE[kind]["fields"].items()}


def example_of(field: Field) -> Any:
    """A value that the field accepts, to copy."""
    if field.example is not None:
        return field.example
    if field.default not in (None, ()):
        return field.default
    if field.among:
        return field.among[0]
    return EXAMPLE_VALUES[field.kind]


def catalogue_lines(kinds: tuple[str, ...]) -> Iterator[str]:
    """Each effect with its keys, at most 80 columns wide; no kinds: all of them.

    Raises EffectError: there is no such effect.
    """
    for number, kind in enumerate(kinds or tuple(CATALOGUE)):
        if number:
            yield ""
        yield f"{kind}: {CATALOGUE[kind]['about']}" if kind in CATALOGUE else kind
        for key, field in fields_of(kind).items():
            yield from _wrapped_lines(f"{key} = {toml_of(example_of(field))}", "  ")
            yield from _wrapped_lines(f"{field.about} ({_requirement_text(field)})", "      ")


def catalogue_data(kinds: tuple[str, ...]) -> dict[str, dict[str, dict[str, Any]]]:
    """The same as data: kind -> key -> kind of value, meaning, unit, default, example."""
    return {
        kind: {
            key: {
                "kind": field.kind,
                "about": field.about,
                "unit": field.unit,
                "default": field.default,
                "required": field.default is None and not field.optional,
                "example": example_of(field),
            }
            for key, field in fields_of(kind).items()
        }
        for kind in kinds or tuple(CATALOGUE)
    }


def toml_of(python_value: Any) -> str:
    """A value as TOML writes it."""
    if isinstance(python_value, Mapping):
        return "{ " + ", ".join(f"{key} = {toml_of(item)}" for key, item in python_value.items()) + " }"
    if isinstance(python_value, list | tuple):
        return "[" + ", ".join(toml_of(item) for item in python_value) + "]"
    if isinstance(python_value, str) and "\n" in python_value:
        return f"'''{python_value}'''"
    return json.dumps(python_value, ensure_ascii=False) if isinstance(python_value, str | bool) else repr(python_value)


def _requirement_text(field: Field) -> str:
    unit = f"{field.unit}, " if field.unit else ""
    if field.default is not None:
        return f"{unit}default {toml_of(field.default)}"
    return f"{unit}{'optional' if field.optional else 'required'}"


def _wrapped_lines(text: str, indent: str) -> Iterator[str]:
    for line in text.splitlines():
        yield from textwrap.wrap(
            line,
            LINE_COLUMNS,
            initial_indent=indent,
            subsequent_indent=indent,
            break_long_words=False,
            break_on_hyphens=False,
        )
