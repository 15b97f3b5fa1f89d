"""Reads and writes a ``RunDocument`` as JSON, and names everything that is wrong with one that somebody sent."""

import json
import types
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Final, Union, get_args, get_origin

import msgspec
from msgspec import Struct
from msgspec.structs import fields

from replay.document.run_document import SCHEMA, RunDocument

ROOT: Final = "the document"


def plain_of(document: Any) -> Any:
    """Return a record, or anything made of records, as mappings, sequences, numbers and text."""
    return msgspec.to_builtins(document, enc_hook=_plain_number)


def _plain_number(value: Any) -> Any:
    """Return a number of numpy as one of Python; the text of anything else."""
    return value.tolist() if hasattr(value, "tolist") else str(value)


def json_of(document: Any) -> str:
    """Return a record as the text of a file; ``ValueError``: a number in it is not finite."""
    return json.dumps(plain_of(document), indent=1, allow_nan=False) + "\n"


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of ``summary.json``, made from the types."""
    schema = msgspec.json.schema(RunDocument)
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "$id": SCHEMA}
    return head | {"title": "summary.json of a run folder"} | schema


def document_of(plain: Any) -> tuple[RunDocument | None, tuple[str, ...]]:
    """Return the document that JSON holds, or ``None`` and every problem with its path.

    Keys that this version does not know are left out.
    """
    try:
        document = msgspec.convert(plain, RunDocument)
    except msgspec.ValidationError:
        return None, tuple(type_problems(plain, RunDocument))
    problems = tuple(_contradictions(document))
    return (None if problems else document), problems


def _contradictions(document: RunDocument) -> Iterator[str]:
    """Names of detectors that one part of a document knows and another does not."""
    for label in document.audit:
        if label not in document.detectors:
            yield f"audit.{label}: no detector of the run has this name"
    if document.audit and document.oracle not in document.detectors:
        yield f"oracle: no detector of the run is called {document.oracle[:40]!r}"
    if {answer.label for answer in document.answers} != document.audit.keys():
        yield "answers: they are about other detectors than those audited"


def type_problems(value: Any, expected: Any, path: str = "") -> Iterator[str]:
    """Every place in JSON where a value is not of the type that a record declares, with its path.

    ``msgspec`` stops at the first problem, so each field that fails is asked again part by part.
    """
    try:
        msgspec.convert(value, expected)
    except msgspec.ValidationError as error:
        problems = [problem for item in _items(value, expected, path) for problem in type_problems(*item)]
        problems += _missing_fields(value, expected, path)
        if problems:
            yield from problems
        else:
            reason = str(error).replace("`", "").partition(" - at ")[0]
            yield f"{path or ROOT}: {reason[:1].lower()}{reason[1:]}"


def _items(value: Any, expected: Any, path: str) -> Iterator[tuple[Any, Any, str]]:
    """Values inside a value, each with the type that it should have and its path."""
    expected = _plain_type(value, expected)
    if _is_record(expected) and isinstance(value, Mapping):
        for field in fields(expected):
            if field.encode_name in value:
                yield value[field.encode_name], field.type, _path_of_key(path, field.encode_name)
    elif get_origin(expected) is dict and isinstance(value, Mapping):
        _, inner = get_args(expected)
        for key, item in value.items():
            yield item, inner, _path_of_key(path, key)
    elif get_origin(expected) is tuple and isinstance(value, list):
        inner = get_args(expected)
        types_of_items = [inner[0]] * len(value) if inner[-1] is Ellipsis else list(inner)
        for index, (item, type_of_item) in enumerate(zip(value, types_of_items, strict=False)):
            yield item, type_of_item, _path_of_key(path, str(index))


def _missing_fields(value: Any, expected: Any, path: str) -> list[str]:
    """A problem for each field that a record needs and a mapping lacks."""
    expected = _plain_type(value, expected)
    if not (_is_record(expected) and isinstance(value, Mapping)):
        return []
    return [
        f"{_path_of_key(path, field.encode_name)}: is missing"
        for field in fields(expected)
        if field.required and field.encode_name not in value
    ]


def _plain_type(value: Any, expected: Any) -> Any:
    """A type without its limits; of a union with ``None`` the other type, unless the value is ``None``."""
    if get_origin(expected) is Annotated:
        return _plain_type(value, get_args(expected)[0])
    if get_origin(expected) in (Union, types.UnionType) and value is not None:
        types_but_none = [kind for kind in get_args(expected) if kind is not types.NoneType]
        return _plain_type(value, types_but_none[0]) if len(types_but_none) == 1 else expected
    return expected


def _is_record(expected: Any) -> bool:
    return isinstance(expected, type) and issubclass(expected, Struct)


def _path_of_key(path: str, key: str) -> str:
    """The path of a key; what somebody sent is cut short."""
    return f"{path}.{key[:80]}" if path else key[:80]
