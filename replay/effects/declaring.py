"""Checks what a scene declares of an effect, field by field; an error names file, table, key and the nearest name."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, Final, cast

from replay.errors import PlanError
from sessions.errors import SessionError
from sessions.model.scene import Scene, SceneEffect
from sessions.scene_files.scene_toml import bodies_by_selector
from sessions.scene_files.toml_table import TomlTable, is_number, nearest

Pair = tuple[str, str]
REQUIRED: Final = object()
"""Default of a field without a default."""


@dataclass(frozen=True, eq=False)
class Field:
    """One key of an ``[[effect]]`` table."""

    kind: str  # ``pairs``, ``bodies``, ``body``, ``number``, ``text``, ``flag``, ``vector``, ``mapping`` or ``words``
    about: str  # its meaning, for the plan and the documentation
    unit: str = ""  # of a number or vector
    # value when absent; ``REQUIRED``: must be given; ``None``: may be absent, and is then ``None``
    default: Any = REQUIRED
    # above, least, most: bounds of a number; ``above`` is excluded, the others are not
    above: float | None = None
    least: float | None = None
    most: float | None = None
    among: tuple[str, ...] = ()  # the words a text may be
    source: str = ""  # where the default comes from


def pairs(about: str, *, required: bool = True) -> Field:
    """``between = [first, second]``: all pairs of a body of the first and one of the second selector."""
    return Field("pairs", about, default=REQUIRED if required else ())


def bodies(about: str, *, required: bool = True) -> Field:
    """An id, ``tag:WORD``, or a list of them."""
    return Field("bodies", about, default=REQUIRED if required else ())


def body(about: str, *, required: bool = True) -> Field:
    """An id, or a ``tag:WORD`` that one body has."""
    return Field("body", about, default=REQUIRED if required else None)


def vector(about: str, unit: str = "m", *, default: Any = REQUIRED) -> Field:
    """Three finite numbers."""
    return Field("vector", about, unit, default)


number = partial(Field, "number")
"""A finite number: ``number(about, unit, default=..., above=..., least=..., most=..., source=...)``."""
text = partial(Field, "text")
"""A text; where ``among`` is given, one of those."""
flag = partial(Field, "flag")
"""True or false."""
mapping = partial(Field, "mapping")
"""A table of the author's own keys."""
words = partial(Field, "words")
"""A table of the author's own keys and of words."""


@dataclass(frozen=True, eq=False)
class Declaration:
    """One ``[[effect]]`` table, checked."""

    kind: str  # the effect
    # file, place: where it stands: ``scene.toml``, ``[[effect]] 3 ('pour')``
    file: str
    place: str
    # every field of the spec; absent ones have their default. Bodies are tuples of names, pairs tuples of pairs.
    values: Mapping[str, Any]

    def fail(self, message: str) -> PlanError:
        """The error to raise: file, table, message."""
        return PlanError(f"{self.file}: {self.place}: {message}")

    def pairs(self, key: str = "between") -> tuple[Pair, ...]:
        """Pairs of names."""
        return cast("tuple[Pair, ...]", self.values[key])

    def bodies(self, key: str) -> tuple[str, ...]:
        """Names of bodies, in the order declared, each once."""
        return cast("tuple[str, ...]", self.values[key])

    def body(self, key: str) -> str:
        """Name of a body; ``""`` where an optional one is absent."""
        return cast(str, self.values[key] or "")

    def number(self, key: str) -> float:
        """A number."""
        return float(self.values[key])

    def text(self, key: str) -> str:
        """A text; ``""`` where an optional one is absent."""
        return cast(str, self.values[key] or "")

    def vector(self, key: str) -> tuple[float, float, float]:
        """Three numbers."""
        return cast("tuple[float, float, float]", self.values[key])

    def mapping(self, key: str) -> Mapping[str, Any]:
        """A table as written."""
        return cast("Mapping[str, Any]", self.values[key])


def declare(effect: SceneEffect, row: int, fields: Mapping[str, Field], scene: Scene, file: str) -> Declaration:
    """Check one declared effect against the fields of its spec.

    Raises PlanError: keys that are missing, unknown or wrong, a body or tag there is not; its ``faults`` are all.
    """
    place = f"[[effect]] {row} ({effect.kind!r})"
    reading = _Reading(scene, f"{file}: {place}: ")
    unknown = [key for key in effect.settings if key not in fields]
    faults = [str(reading.fail(f"unknown key {key!r}{nearest(key, fields)}")) for key in unknown]
    values = {}
    for key in fields:
        try:
            values[key] = reading.read(key, fields[key], effect)
        except PlanError as error:
            faults += error.faults
    one_of: dict[str, str] = {}
    for key in (key for key, field in fields.items() if field.kind == "body" and values.get(key)):
        known = one_of.setdefault(values[key], key)
        if known != key:
            faults.append(str(reading.fail(f"{key} is {values[key]!r} and so is {known}; name two bodies")))
    if faults:
        raise PlanError(*faults)
    return Declaration(effect.kind, file, place, values)


class _Reading:
    def __init__(self, scene: Scene, head: str) -> None:
        self._scene, self._head = scene, head

    def fail(self, message: str) -> PlanError:
        return PlanError(f"{self._head}{message}")

    def read(self, key: str, field: Field, effect: SceneEffect) -> Any:
        value = effect.settings.get(key, field.default)
        if value is REQUIRED:
            unit = f" in {field.unit}" if field.unit else ""
            raise self.fail(f"{key} is missing: {field.about}{unit}")
        if key not in effect.settings:
            return value
        if field.kind in SIMPLE:
            fits, wanted, made = SIMPLE[field.kind]
            if not fits(value):
                raise self.fail(f"{key} is {value!r}; give {wanted}")
            if field.among and value not in field.among:
                raise self.fail(f"{key} is {value!r}{nearest(value, field.among)}")
            return made(value)
        if field.kind == "number":
            return self._number(key, value, field)
        return {"pairs": self._pairs, "bodies": self._bodies, "body": self._body}[field.kind](key, value)

    def _selected(self, key: str, word: object) -> tuple[str, ...]:
        if not isinstance(word, str) or not word:
            raise self.fail(f"{key} names {word!r}; give ids of bodies or tag:WORD")
        named = bodies_by_selector(self._scene.bodies)
        if word not in named:
            raise self.fail(f"{key}: no body is {word!r}{nearest(word, named)}")
        return tuple(named[word])

    def _bodies(self, key: str, value: Any) -> tuple[str, ...]:
        words = value if isinstance(value, list | tuple) else [value]
        if not words:
            raise self.fail(f"{key} is empty; give ids of bodies or tag:WORD")
        return tuple(dict.fromkeys(name for word in words for name in self._selected(key, word)))

    def _body(self, key: str, value: Any) -> str:
        found = self._selected(key, value)
        if len(found) > 1:
            raise self.fail(f"{key} is {value!r}, which stands for {', '.join(found)}; give one body")
        return found[0]

    def _pairs(self, key: str, value: Any) -> tuple[Pair, ...]:
        if not isinstance(value, list | tuple) or len(value) != 2:
            raise self.fail(f"{key} is {value!r}; give two: [first, second], each an id or tag:WORD")
        first, second = (self._selected(key, word) for word in value)
        chosen: dict[frozenset[str], Pair] = {}
        for pair in ((a, b) for a in first for b in second if a != b):
            chosen.setdefault(frozenset(pair), pair)
        if not chosen:
            raise self.fail(f"{key} pairs {first[0]!r} with itself; a pair needs two bodies")
        return tuple(chosen.values())

    def _number(self, key: str, value: Any, field: Field) -> float:
        unit = f" {field.unit}" if field.unit else ""
        if not is_number(value):
            raise self.fail(f"{key} is {value!r}; give a finite number{unit and ' in' + unit}")
        for bad, words in (
            (field.above is not None and not value > field.above, f"above {field.above}"),
            (field.least is not None and value < field.least, f"at least {field.least}"),
            (field.most is not None and value > field.most, f"at most {field.most}"),
        ):
            if bad:
                raise self.fail(f"{key} is {value!r}; give {words}{unit}")
        return float(value)


SIMPLE: Final[dict[str, tuple[Callable[[Any], bool], str, Callable[[Any], Any]]]] = {
    "text": (lambda value: isinstance(value, str) and bool(value), "text", str),
    "flag": (lambda value: isinstance(value, bool), "true or false", bool),
    "vector": (lambda value: isinstance(value, list | tuple) and len(value) == 3 and all(map(is_number, value)),
               "three finite numbers", lambda value: tuple(map(float, value))),
    "words": (lambda value: isinstance(value, Mapping) and all(isinstance(one, str) for one in value.values()),
              "a table of words", dict),
    "mapping": (lambda value: isinstance(value, Mapping), "a table", dict),
}  # fmt: skip
"""Kind of a field -> whether a value is of it, what is asked for, and what is made of it."""


BODY_KEYS: Final[Mapping[str, Any]] = {
    "cavity": dict.fromkeys(
        ("shape", "capacity_ml", "floor", "mark", "radius", "height", "opening_radius", "opening", "lip"), ""
    ),
    "properties": {
        "liquid": dict.fromkeys(("volume_ml", "solute", "molar", "water_molar", "solutes"), ""),
        "solid": dict.fromkeys(("formula", "mass_g", "density_g_ml"), ""),
        "heat_capacity_j_per_k": "", "temperature_c": "",
    },
}  # fmt: skip
"""Key -> the keys of the table it is, or ``""`` where it is none. Nothing else is read by any effect."""


def body_faults(scene: Scene, file: str, more: Mapping[str, Any]) -> list[str]:
    """Every unknown key of a body's tables; file, table, key and the nearest known name.

    ``more``: further keys of ``properties``.
    """
    faults: list[str] = []
    known = {**BODY_KEYS, "properties": {**BODY_KEYS["properties"], **more}}
    for row, body in enumerate(scene.bodies, start=1):
        held = {key: value for key, value in body.extra.items() if key in known}
        _look(TomlTable(held, file, f"[[body]] {row} ({body.id!r})", SessionError, faults), known)
    return faults


def _look(table: TomlTable, known: Mapping[str, Any]) -> None:
    for key, keys in known.items():
        inner = table.table(key) if keys else None
        if inner is not None:
            _look(inner, keys)
    table.done(known)
