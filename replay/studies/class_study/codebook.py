"""The codebook of a questionnaire: item -> construct, scale and direction; and which regressions are asked.

It is written before the data are seen: what is not declared here is not analysed.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from replay.errors import StudyError
from sessions.input_files import TomlTable, read_text

DEFAULT_SCALE: Final = (1.0, 5.0)
"""Ends of the scale where the codebook names none."""


@dataclass(frozen=True)
class Item:
    """One question: its construct, its scale's ends, and whether agreement speaks against the construct."""

    name: str
    construct: str
    scale: tuple[float, float]
    reversed: bool = False


@dataclass(frozen=True)
class Codebook:
    """Meaning of a questionnaire and the questions of its analysis.

    ``student`` is the column with the student's pseudonym; ``questions`` are regressions, an outcome and its predictors
    each; ``group_column`` holds one of the declared ``groups``, of which there are none where none are compared.
    """

    student: str
    items: tuple[Item, ...]
    questions: tuple[tuple[str, ...], ...] = ()
    group_column: str = ""
    groups: tuple[str, ...] = ()

    @property
    def constructs(self) -> dict[str, list[str]]:
        """Construct -> names of its items, in the order declared."""
        constructs: dict[str, list[str]] = {}
        for item in self.items:
            constructs.setdefault(item.construct, []).append(item.name)
        return constructs


def read_codebook(path: Path) -> Codebook:
    """Read a codebook.

    Raises ``StudyError``: not YAML, or a key that is unknown, missing or of the wrong kind; it names the place and
    the nearest known name.
    """
    import yaml

    try:
        codebook_text = read_text(path, "codebook", StudyError)
        # A few lines of aliases of aliases unfold to gigabytes.
        if any(isinstance(token, yaml.AliasToken) for token in yaml.scan(codebook_text)):
            raise StudyError(f"{path.name}: aliases (*name) are not read; write out what they stand for")
        content = _with_labels(yaml.safe_load(codebook_text))
    except (yaml.YAMLError, RecursionError) as error:
        raise StudyError(f"{path} cannot be read as YAML: {' '.join(str(error).split())}") from error
    if not isinstance(content, dict):
        raise StudyError(f"{path.name}: must be a table of names and values, not {content!r:.60}")
    for section, section_type, section_form in (
        ("items", dict, "a table of tables"),
        ("regressions", list, "a list of tables"),
    ):
        section_content = content.get(section, section_type())
        entries = section_content.values() if isinstance(section_content, dict) else section_content
        if not isinstance(section_content, section_type) or not all(isinstance(entry, dict) for entry in entries):
            raise StudyError(f"{path.name}: {section} must be {section_form}, not {section_content!r:.60}")
    error_class: Any = StudyError
    codebook_table = TomlTable(content, path.name, "", error_class)
    student, scale = codebook_table.text("student", "student"), _read_scale(codebook_table, DEFAULT_SCALE)
    items = tuple(_read_item(name, entry, scale) for name, entry in codebook_table.named_tables("items").items())
    questions = tuple(_read_question(entry) for entry in codebook_table.tables("regressions") or ())
    groups_table = codebook_table.table("groups")
    groups = () if groups_table is None else _read_groups(groups_table)
    codebook_table.done()
    if not items:
        raise codebook_table.fail("items is empty; declare at least one item, as `peu1: {construct: ease of use}`")
    return Codebook(student, items, questions, *groups)


def _with_labels(yaml_value: Any) -> Any:
    """The same tables with texts as keys: YAML reads ``1:`` as a number. Dates, which no key wants, become texts."""
    if isinstance(yaml_value, dict):
        return {str(key): _with_labels(entry) for key, entry in yaml_value.items()}
    if isinstance(yaml_value, list):
        return [_with_labels(entry) for entry in yaml_value]
    return yaml_value if isinstance(yaml_value, str | int | float | None) else str(yaml_value)


def _read_scale(table: TomlTable, default: tuple[float, float]) -> tuple[float, float]:
    smallest, largest = table.vector("scale", default)
    if not smallest < largest:
        raise table.fail(f"scale must rise, not [{smallest:g}, {largest:g}]")
    return smallest, largest


def _read_item(name: str, table: TomlTable, scale: tuple[float, float]) -> Item:
    item = Item(name, table.text("construct", None), _read_scale(table, scale), table.flag("reversed"))
    table.done()
    return item


def _read_question(table: TomlTable) -> tuple[str, ...]:
    outcome, predictors = table.text("outcome", None), table.texts("predictors")
    if not predictors:
        raise table.fail("predictors is empty; name one or more")
    if len({outcome, *predictors}) <= len(predictors):
        raise table.fail(f"{outcome} and its predictors must differ from each other")
    table.done()
    return (outcome, *predictors)


def _read_groups(table: TomlTable) -> tuple[str, tuple[str, ...]]:
    column, remaining_keys = table.text("column", None), table.rest()
    names = remaining_keys.pop("names", None)
    if remaining_keys:
        raise table.fail(f"unknown key {next(iter(remaining_keys))!r}; there are: column, names")
    if not isinstance(names, list) or len(names) < 2:
        raise table.fail("names must list at least two groups")
    return column, tuple(map(str, names))
