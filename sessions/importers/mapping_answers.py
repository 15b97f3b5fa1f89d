"""Answers to what an import guessed, in the mapping file of a CSV or XDF: the next import by it asks nothing again.

Lines of the file are changed or added one by one, so that comments and order stay as their author wrote them.
"""

import json
import re
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from sessions.errors import ImportFileError
from sessions.importers.csv_columns_and_units import Guessable
from sessions.importers.given_meshes import COLLIDER_AXES_KEY, MESH_AXES_KEY, MESH_UNITS_KEY
from sessions.input_files import read_bytes, read_text
from sessions.model.assumption import Assumption, Subject
from sessions.whole_files import whole_file

KEYS: Final = {
    Subject.POSE_AXES: "convention",
    Subject.LENGTH_UNIT: str(Guessable.LENGTH_UNIT),
    Subject.MESH_AXES: MESH_AXES_KEY,
    Subject.MESH_UNIT: MESH_UNITS_KEY,
    Subject.COLLIDER_AXES: COLLIDER_AXES_KEY,
}
"""Subject of an answer -> the key of a mapping that holds it."""

BY_BODY: Final = (Subject.MESH_AXES, Subject.MESH_UNIT)
"""Subjects whose key is a list with an entry for each body."""

GUESSED: Final = "guessed"

ANSWERED_MAPPING_FACT: Final = "answered_mapping"
"""The fact of a recording that says which mapping got its answers too, from the folder of the recording."""

NOTHING: Final = "nothing"

ANSWERED: Final = re.compile(r"(?P<line>.*?)  # answered; before: (?P<before>.*)")
"""A line that an answer wrote, with what stood there before."""


def write_answers(path: Path, answers: Sequence[tuple[Assumption, str]]) -> list[str]:
    """Writes the values that a user chose for assumptions into a mapping file; returns the keys that it holds now.

    Each line says behind its value what stood there before, so that `forget_mapping_answers` brings it back.

    Raises ImportFileError: the file is no mapping, or a key spans several lines; it then stays as it is.
    """
    text = _text(path)
    written = []
    for assumption, value in answers:
        data = _parse_mapping(text, path)
        key = KEYS[assumption.subject]
        changed: Any = value
        if assumption.subject in BY_BODY:
            before = data.get(key, [])
            entries = [before] if isinstance(before, str) else before
            others = [entry for entry in entries if entry.rpartition("=")[0] not in assumption.bodies]
            changed = [*others, *(f"{body}={value}" for body in assumption.bodies)]
        text = _with_key(text, key, changed, path)
        guessed = [entry for entry in data.get(GUESSED, []) if entry != key]
        if GUESSED in data and guessed != data[GUESSED]:
            text = _with_key(text, GUESSED, guessed, path)
        written.append(key)
    with whole_file(path, ImportFileError, overwrite=True) as stream:
        stream.write(text.encode())
    return list(dict.fromkeys(written))


def forget_mapping_answers(path: Path) -> int:
    """Brings back every line of a mapping that an answer changed; returns how many there were.

    Raises ImportFileError: the file cannot be read or written.
    """
    lines = _text(path).splitlines(keepends=True)
    kept, count = list[str](), 0
    for line in lines:
        text = line.rstrip("\r\n")
        answer = ANSWERED.fullmatch(text)
        if answer is None:
            kept.append(line)
            continue
        count += 1
        if answer["before"] != NOTHING:
            kept.append(answer["before"] + line[len(text) :])
    if count:
        with whole_file(path, ImportFileError, overwrite=True) as stream:
            stream.write("".join(kept).encode())
    return count


def _text(path: Path) -> str:
    """The text of a mapping with its own line breaks."""
    read_text(path, "mapping", ImportFileError)
    return read_bytes(path, "mapping", ImportFileError).decode("utf-8-sig")


def _parse_mapping(text: str, path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ImportFileError(f"{path}: this is not TOML: {error}") from None


def _with_key(text: str, key: str, value: Any, path: Path) -> str:
    """The text with a key above all tables: in place of the line that has it, of the comment that drafts it, or new."""
    line = f"{key} = {json.dumps(value, ensure_ascii=False)}"
    lines = text.splitlines(keepends=True)
    line_break = "\r\n" if lines and lines[0].endswith("\r\n") else "\n"
    end = next((number for number, row in enumerate(lines) if row.lstrip().startswith("[")), len(lines))
    for pattern in (rf"\s*{key}\s*=", rf"#\s*{key}\s*="):
        number = next((number for number in range(end) if re.match(pattern, lines[number])), None)
        if number is not None:
            before = lines[number].rstrip("\r\n")
            answer = ANSWERED.fullmatch(before)
            lines[number] = _answered_line(line, answer["before"] if answer else before) + line_break
            break
    else:
        above = end
        while above and not lines[above - 1].strip():
            above -= 1
        if above and not lines[above - 1].endswith("\n"):
            lines[above - 1] += line_break
        lines.insert(above, _answered_line(line, NOTHING) + line_break)
    changed = "".join(lines)
    data = _parse_mapping(text, path)
    try:
        after = tomllib.loads(changed)
    except tomllib.TOMLDecodeError:
        after = {}
    if after != {**data, key: value}:
        raise ImportFileError(f"{path}: {key} cannot be changed in place; write it there: {line}")
    return changed


def _answered_line(line: str, before: str) -> str:
    return f"{line}  # answered; before: {before}"
