"""Reads and writes a ``RunDocument`` as JSON, and names everything that is wrong with one that somebody sent."""

import json
import types
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Final, Union, get_args, get_origin

import msgspec
from msgspec import Struct
from msgspec.structs import fields

from replay.document.run_document import SCHEMA, RunDocument

ROOT_NAME: Final = "the document"


def plain_of(document: Any) -> Any:
    """Return a record, or anything made of records, as mappings, sequences, numbers and text."""
    return msgspec.to_builtins(document, enc_hook=_plain_number)


def _plain_number(numpy_value: Any) -> Any:
    """Return a number of numpy as one of Python; the text of anything else."""
    return numpy_value.tolist() if hasattr(numpy_value, "tolist") else str(numpy_value)


def json_of(document: Any) -> str:
    """Return a record as the text of a file; ``ValueError``: a number in it is not finite."""
    # ``indent`` of json.dumps would encode in Python, four times as slowly.
    return msgspec.json.format(json.dumps(plain_of(document), allow_nan=False), indent=1) + "\n"


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of ``summary.json``, made from the types."""
    schema = msgspec.json.schema(RunDocument)
    schema_head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "$id": SCHEMA}
    return schema_head | {"title": "summary.json of a run folder"} | schema


def document_of(json_value: Any) -> tuple[RunDocument | None, tuple[str, ...]]:
    """Return the document that JSON holds, or ``None`` and every problem with its path.

    Keys that this version does not know are left out.
    """
    try:
        document = msgspec.convert(json_value, RunDocument)
    except msgspec.ValidationError:
        return None, tuple(type_problems(json_value, RunDocument))
    problems = tuple(_unknown_detectors(document))
    return (None if problems else document), problems


def _unknown_detectors(document: RunDocument) -> Iterator[str]:
    """Names of detectors that one part of a document knows and another does not."""
    for label in document.audit:
        if label not in document.detectors:
            yield f"audit.{label}: no detector of the run has this name"
    if document.audit and document.oracle not in document.detectors:
        yield f"oracle: no detector of the run is called {document.oracle[:40]!r}"
    if {answer.label for answer in document.answers} != document.audit.keys():
        yield "answers: they are about other detectors than those audited"


def type_problems(json_value: Any, expected_type: Any, path: str = "") -> Iterator[str]:
    """Every place in JSON where a value is not of the type that a record declares, with its path.

    ``msgspec`` stops at the first problem, so each field that fails is asked again part by part.
    """
    try:
        msgspec.convert(json_value, expected_type)
    except msgspec.ValidationError as error:
        problems = [
            problem for item in _typed_items(json_value, expected_type, path) for problem in type_problems(*item)
        ]
        problems += _missing_fields(json_value, expected_type, path)
        if problems:
            yield from problems
        else:
            reason = str(error).replace("`", "").partition(" - at ")[0]
            yield f"{path or ROOT_NAME}: {reason[:1].lower()}{reason[1:]}"


def _typed_items(json_value: Any, expected_type: Any, path: str) -> Iterator[tuple[Any, Any, str]]:
    """Values inside a value, each with the type that it should have and its path."""
    expected_type = _plain_type(json_value, expected_type)
    if _is_record(expected_type) and isinstance(json_value, Mapping):
        for field in fields(expected_type):
            if field.encode_name in json_value:
                yield json_value[field.encode_name], field.type, _path_of_key(path, field.encode_name)
    elif get_origin(expected_type) is dict and isinstance(json_value, Mapping):
        _, inner = get_args(expected_type)
        for key, item in json_value.items():
            yield item, inner, _path_of_key(path, key)
    elif get_origin(expected_type) is tuple and isinstance(json_value, list):
        inner = get_args(expected_type)
        types_of_items = [inner[0]] * len(json_value) if inner[-1] is Ellipsis else list(inner)
        for index, (item, type_of_item) in enumerate(zip(json_value, types_of_items, strict=False)):
            yield item, type_of_item, _path_of_key(path, str(index))


def _missing_fields(json_object: Any, record_type: Any, path: str) -> list[str]:
    """A problem for each field that a record needs and a mapping lacks."""
    record_type = _plain_type(json_object, record_type)
    if not (_is_record(record_type) and isinstance(json_object, Mapping)):
        return []
    return [
        f"{_path_of_key(path, field.encode_name)}: is missing"
        for field in fields(record_type)
        if field.required and field.encode_name not in json_object
    ]


def _plain_type(json_value: Any, expected_type: Any) -> Any:
    """A type without its limits; of a union with ``None`` the other type, unless the value is ``None``."""
    if get_origin(expected_type) is Annotated:
        return _plain_type(json_value, get_args(expected_type)[0])
    if get_origin(expected_type) in (Union, types.UnionType) and json_value is not None:
        types_but_none = [kind for kind in get_args(expected_type) if kind is not types.NoneType]
        return _plain_type(json_value, types_but_none[0]) if len(types_but_none) == 1 else expected_type
    return expected_type


def _is_record(expected_type: Any) -> bool:
    return isinstance(expected_type, type) and issubclass(expected_type, Struct)


def _path_of_key(path: str, key: str) -> str:
    """The path of a key; what somebody sent is cut short."""
    return f"{path}.{key[:80]}" if path else key[:80]
