"""The codebook of a questionnaire: item -> construct, scale and direction; and which regressions are asked.

It is written before the data are seen: what is not declared here is not analysed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from replay.errors import StudyError

TOP = ("student", "scale", "items", "regressions", "groups")
ITEM = ("construct", "scale", "reversed")
REGRESSION = ("outcome", "predictors")
GROUPS = ("column", "names")


@dataclass(frozen=True)
class Item:
    """One question: its construct, its scale's ends, and whether agreement speaks against the construct."""

    name: str
    construct: str
    scale: tuple[float, float]
    reversed: bool = False


@dataclass(frozen=True)
class Question:
    """One regression asked: an outcome and its predictors, by name."""

    outcome: str
    predictors: tuple[str, ...]


@dataclass(frozen=True)
class Codebook:
    """What a questionnaire means and what is asked of it.

    Parameters
    ----------
    student : column with the student's pseudonym.
    items : every question, in the order declared.
    questions : regressions asked.
    groups : column of the declared groups and their names; ``None``: none are compared.
    """

    student: str
    items: tuple[Item, ...]
    questions: tuple[Question, ...] = ()
    groups: tuple[str, tuple[str, ...]] | None = None
    path: Path | None = field(default=None, compare=False)

    @property
    def constructs(self) -> dict[str, tuple[Item, ...]]:
        """Construct -> its items, in the order declared."""
        names = dict.fromkeys(item.construct for item in self.items)
        return {name: tuple(item for item in self.items if item.construct == name) for name in names}


def read_codebook(path: Path) -> Codebook:
    """Read a codebook.

    Raises ``StudyError``: not YAML, or a field that is unknown, missing or of the wrong kind; it names the place and
    the nearest known name.
    """
    import yaml

    try:
        loaded = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError, RecursionError) as error:
        raise StudyError(f"{path} cannot be read as YAML: {' '.join(str(error).split())}") from error
    where = path.name
    table = _table(loaded, TOP, where)
    scale = _scale(table.get("scale", [1, 5]), f"{where}: scale")
    declared = _mapping(table.get("items"), f"{where}: items")
    items = tuple(_item(str(name), value, scale, f"{where}: items: {name}") for name, value in declared.items())
    if not items:
        raise StudyError(f"{where}: items is empty; declare at least one item, as `peu1: {{construct: ease of use}}`")
    asked = table.get("regressions", [])
    if not isinstance(asked, list):
        raise StudyError(f"{where}: regressions must be a list of outcome and predictors")
    questions = tuple(_question(value, f"{where}: regressions: {k + 1}") for k, value in enumerate(asked))
    groups = _groups(table["groups"], f"{where}: groups") if "groups" in table else None
    return Codebook(_word(table.get("student", "student"), f"{where}: student"), items, questions, groups, path)


def _item(name: str, value: object, scale: tuple[float, float], where: str) -> Item:
    table = _table(value, ITEM, where)
    turned = table.get("reversed", False)
    if not isinstance(turned, bool):
        raise StudyError(f"{where}: reversed must be true or false, not {turned!r}")
    own = _scale(table["scale"], f"{where}: scale") if "scale" in table else scale
    return Item(name, _word(table.get("construct"), f"{where}: construct"), own, turned)


def _question(value: object, where: str) -> Question:
    table = _table(value, REGRESSION, where)
    predictors = table.get("predictors")
    if not isinstance(predictors, list) or not predictors:
        raise StudyError(f"{where}: predictors must be a list of names")
    names = tuple(_word(name, f"{where}: predictors") for name in predictors)
    outcome = _word(table.get("outcome"), f"{where}: outcome")
    if len({outcome, *names}) < len(names) + 1:
        raise StudyError(f"{where}: {outcome} and its predictors must differ from each other")
    return Question(outcome, names)


def _groups(value: object, where: str) -> tuple[str, tuple[str, ...]]:
    table = _table(value, GROUPS, where)
    names = table.get("names")
    if not isinstance(names, list) or len(names) < 2:
        raise StudyError(f"{where}: names must list at least two groups")
    return _word(table.get("column"), f"{where}: column"), tuple(str(name) for name in names)


def _table(value: object, known: tuple[str, ...], where: str) -> Mapping[str, Any]:
    table = _mapping(value, where)
    for key in table:
        if key not in known:
            near = get_close_matches(str(key), known, n=1)
            hint = f"did you mean {near[0]!r}?" if near else f"there are: {', '.join(known)}"
            raise StudyError(f"{where}: unknown field {key!r}; {hint}")
    return table


def _mapping(value: object, where: str) -> Mapping[Any, Any]:
    if not isinstance(value, Mapping):
        raise StudyError(f"{where}: must be a table of names and values, not {value!r:.60}")
    return value


def _scale(value: object, where: str) -> tuple[float, float]:
    whole = isinstance(value, list) and len(value) == 2
    if not whole or not all(isinstance(end, int | float) and not isinstance(end, bool) for end in value):  # type: ignore[attr-defined]
        raise StudyError(f"{where}: must be two numbers as [1, 5], not {value!r:.60}")
    low, high = (float(end) for end in value)  # type: ignore[attr-defined]
    if not low < high:
        raise StudyError(f"{where}: must rise, not {value!r}")
    return low, high


def _word(value: object, where: str) -> str:
    if not isinstance(value, str) or not value.strip():
        raise StudyError(f"{where}: must be a word, not {value!r:.60}")
    return value
