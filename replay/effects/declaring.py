"""Checks what a scene declares of an effect, field by field; an error names file, table, key and the nearest name."""

import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import product
from types import MappingProxyType
from typing import Any, Final

from replay.effects.output import COLOUR_WORDS, COLOURS, SHADES
from replay.errors import PlanError
from sessions.errors import SessionError
from sessions.input_files import TomlTable, is_number, nearest
from sessions.model.scene import Scene, SceneEffect
from sessions.scene_files.scene_toml import bodies_by_selector

Pair = tuple[str, str]


@dataclass(frozen=True, eq=False)
class Field:
    """One key of an ``[[effect]]`` table; it must be given unless it is optional or has a default."""

    kind: str  # of `READERS`
    about: str  # its meaning, for the plan and the documentation
    unit: str = ""  # of a number or vector
    default: Any = None  # value when absent
    optional: bool = False  # it may be absent, and is then ``None``
    # above, least, most: bounds of a number; ``above`` is excluded, the others are not
    above: float | None = None
    least: float | None = None
    most: float | None = None
    among: tuple[str, ...] = ()  # the words a text may be
    example: Any = None  # a value that a reader can copy


def field_of(row: Mapping[str, Any]) -> Field:
    """A field from its row in the catalogue: its kind with its meaning, and any other keys of `Field`."""
    (kind, about), *other_keys = row.items()
    extra_fields: dict[str, Any] = {
        key: tuple(value) if isinstance(value, list) else value for key, value in other_keys
    }
    return Field(kind, about, **extra_fields)


@dataclass(frozen=True, eq=False)
class Declaration:
    """One ``[[effect]]`` table, checked."""

    kind: str  # the effect
    # file, place: where it stands: ``scene.toml``, ``[[effect]] 3 ('pour')``
    file: str
    table: str
    # every field of the spec, ``declaration["key"]``; absent ones have their default. Bodies are tuples of names, pairs
    # tuples of pairs.
    values: Mapping[str, Any]

    def __getitem__(self, key: str) -> Any:
        return self.values[key]

    def fail(self, message: str) -> PlanError:
        """The error to raise: file, table, message."""
        return PlanError(f"{self.file}: {self.table}: {message}")


def declare(
    effect: SceneEffect,
    row: int,
    fields: Mapping[str, Field],
    scene: Scene,
    file: str,
    retired: Mapping[str, str] = MappingProxyType({}),
) -> Declaration:
    """Check one declared effect against the fields of its spec.

    ``retired`` : keys, and words of a text, that older scenes hold -> what to write instead.

    Raises PlanError: keys that are missing, unknown or wrong, a body or tag there is not; its ``faults`` are all.
    """
    field_values: dict[str, Any] = {}
    declaration = Declaration(effect.kind, file, f"[[effect]] {row} ({effect.kind!r})", field_values)
    faults = [_unknown_key_message(key, fields, retired) for key in effect.settings if key not in fields]
    body_names: dict[str, str] = {}
    for key, field in fields.items():
        if key not in effect.settings:
            field_values[key] = field.default
            if field.default is None and not field.optional:
                faults.append(f"{key} is missing: {field.about}{field.unit and ' in ' + field.unit}")
            continue
        try:
            field_values[key] = READERS[field.kind](effect.settings[key], field, scene)
        except ValueError as error:
            advice = retired.get(str(effect.settings[key])) if field.among else None
            faults.append(f"{key}{error}" if advice is None else f"{key} is {effect.settings[key]!r}: {advice}")
            continue
        if field.kind == "body" and body_names.setdefault(field_values[key], key) != key:
            faults.append(f"{key} is {field_values[key]!r} and so is {body_names[field_values[key]]}; name two bodies")
    if faults:
        raise PlanError(*(str(declaration.fail(fault)) for fault in faults))
    return declaration


def _unknown_key_message(key: str, fields: Mapping[str, Field], retired: Mapping[str, str]) -> str:
    """Says what to write instead of a key that an effect does not have."""
    advice = retired.get(key)
    return f"unknown key {key!r}{nearest(key, fields)}" if advice is None else f"{key}: {advice}"


def _bodies_of_selector(selector: object, scene: Scene) -> tuple[str, ...]:
    if not isinstance(selector, str) or not selector:
        raise ValueError(f" names {selector!r}; give ids of bodies or tag:WORD")
    bodies_by_name = bodies_by_selector(scene)
    if selector not in bodies_by_name:
        raise ValueError(f": no body is {selector!r}{nearest(selector, bodies_by_name)}")
    return tuple(bodies_by_name[selector])


def _bodies(selector_value: Any, _: Field, scene: Scene) -> tuple[str, ...]:
    selectors = selector_value if isinstance(selector_value, list | tuple) else [selector_value]
    if not selectors:
        raise ValueError(" is empty; give ids of bodies or tag:WORD")
    return tuple(dict.fromkeys(name for word in selectors for name in _bodies_of_selector(word, scene)))


def _body(selector_value: Any, _: Field, scene: Scene) -> str:
    first, *more = _bodies_of_selector(selector_value, scene)
    if more:
        raise ValueError(f" is {selector_value!r}, which stands for {', '.join((first, *more))}; give one body")
    return first


def _pairs(selector_pair: Any, _: Field, scene: Scene) -> tuple[Pair, ...]:
    if not isinstance(selector_pair, list | tuple) or len(selector_pair) != 2:
        raise ValueError(f" is {selector_pair!r}; give two: [first, second], each an id or tag:WORD")
    first, second = (_bodies_of_selector(word, scene) for word in selector_pair)
    chosen_pairs: dict[frozenset[str], Pair] = {}
    for a, b in product(first, second):
        if a != b:
            chosen_pairs.setdefault(frozenset((a, b)), (a, b))
    if not chosen_pairs:
        raise ValueError(f" pairs {first[0]!r} with itself; a pair needs two bodies")
    return tuple(chosen_pairs.values())


def _number(toml_value: Any, field: Field, _: Scene) -> float:
    if not is_number(toml_value):
        raise ValueError(f" is {toml_value!r}; give a finite number{field.unit and ' in ' + field.unit}")
    for bound, is_within, limit in (
        (field.above, operator.gt, "above"),
        (field.least, operator.ge, "at least"),
        (field.most, operator.le, "at most"),
    ):
        if bound is not None and not is_within(toml_value, bound):
            raise ValueError(f" is {toml_value!r}; give {limit} {bound}{field.unit and ' ' + field.unit}")
    return float(toml_value)


def _text(toml_value: Any, field: Field, _: Scene) -> str:
    if not isinstance(toml_value, str) or not toml_value:
        raise ValueError(f" is {toml_value!r}; give text")
    if field.kind == "colour" and toml_value not in COLOURS:
        plain_colours = ", ".join(word for word in COLOUR_WORDS if " " not in word)
        raise ValueError(
            f" is {toml_value!r}; there are: {plain_colours}; two as in red-brown, and {', '.join(SHADES)} before them"
        )
    allowed_texts = () if field.kind == "colour" else field.among
    if allowed_texts and toml_value not in allowed_texts:
        raise ValueError(f" is {toml_value!r}{nearest(toml_value, allowed_texts)}")
    return toml_value


def _vector(toml_value: Any, _: Field, __: Scene) -> tuple[float, ...]:
    if not isinstance(toml_value, list | tuple) or len(toml_value) != 3 or not all(map(is_number, toml_value)):
        raise ValueError(f" is {toml_value!r}; give three finite numbers")
    return tuple(map(float, toml_value))


def _table(toml_value: Any, field: Field, _: Scene) -> dict[str, Any]:
    of_text = field.kind == "words"
    if not isinstance(toml_value, Mapping) or (
        of_text and not all(isinstance(item, str) for item in toml_value.values())
    ):
        raise ValueError(f" is {toml_value!r}; give a table{' of words' if of_text else ''}")
    return dict(toml_value)


READERS: Final[Mapping[str, Callable[[Any, Field, Scene], Any]]] = {
    "pairs": _pairs,
    "bodies": _bodies,
    "body": _body,
    "number": _number,
    "text": _text,
    "colour": _text,
    "vector": _vector,
    "mapping": _table,
    "words": _table,
}
"""Kind of a field -> what reads it: pairs of two selectors, bodies of one, one body, a number, a word, three numbers, a
table of the author's own keys (``words``: and of words)."""


BODY_KEYS: Final[Mapping[str, Any]] = {
    "cavity": dict.fromkeys(
        ("capacity_ml", "floor", "mark", "radius", "height", "opening_radius", "opening", "lip"), ""
    ),
    "properties": {
        "liquid": dict.fromkeys(("volume_ml", "solute", "molar", "water_molar", "solutes"), ""),
        "solid": dict.fromkeys(("formula", "mass_g", "density_g_ml", "solubility_g_100g"), ""),
        "heat_capacity_j_per_k": "",
        "temperature_c": "",
    },
}
"""Key -> the keys of the table it is, or ``""`` where it is none. Nothing else is read by any effect."""


def body_faults(scene: Scene, file: str) -> list[str]:
    """Every unknown key of a body's tables; file, table, key and the nearest known name."""
    faults: list[str] = []

    def check(table: TomlTable, keys: Mapping[str, Any]) -> None:
        for key, subkeys in keys.items():
            inner_table = table.table(key) if subkeys else None
            if inner_table is not None:
                check(inner_table, subkeys)
        table.done(keys)

    for row, body in enumerate(scene.bodies, start=1):
        tables_of_body = {key: value for key, value in body.extra.items() if key in BODY_KEYS}
        check(TomlTable(tables_of_body, file, f"[[body]] {row} ({body.id!r})", SessionError, faults), BODY_KEYS)
    return faults
