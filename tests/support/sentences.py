"""The sentences that a module can print, read from its source, so that none can stay untested."""

import ast
import re
from pathlib import Path

from rerun.chunk import RrdReader

from replay.outputs.rerun_log.recording import write_recording

SOURCE = Path(write_recording.__code__.co_filename).parents[3]
FIELD = re.compile(r"\{[^{}]*\}")
WORD = re.compile(r"(?<!\S)[(\"*-]*[A-Za-z][A-Za-z'-]*[\",.;:)*]*(?!\S)")
VALUE = r"[\s\S]{0,300}?"
"""What stands where a value is filled in."""


def sources(*patterns):
    """Modules by patterns of their paths, so that a new one of a folder is among them."""
    found = [path for pattern in patterns for path in sorted(SOURCE.glob(pattern)) if path.name != "__init__.py"]
    assert len(found) >= len(patterns)
    return found


def templates(path):
    """Texts of a module that are printed, ``{}`` for each value: of three words or more, and no docstring or error."""
    nodes = list(ast.walk(ast.parse(path.read_text("utf-8"))))
    silent = (ast.Raise, ast.Assert)
    quiet = {id(one) for node in nodes if isinstance(node, silent) for one in ast.walk(node)}
    quiet |= {id(node.value) for node in nodes if isinstance(node, ast.Expr)}
    joined = [node for node in nodes if isinstance(node, ast.JoinedStr) and id(node) not in quiet]
    quiet |= {id(part) for node in joined for part in node.values}
    texts = ["".join(getattr(part, "value", "") if isinstance(part, ast.Constant) else "{}" for part in node.values)
             for node in joined]  # fmt: skip
    texts += [one.value for one in nodes if isinstance(one, ast.Constant) and id(one) not in quiet]
    said = {FIELD.sub("{}", text) for text in texts if isinstance(text, str)}
    return {text for text in said if len(WORD.findall(text.replace("{}", " 0 "))) >= 3}


def unsaid(text, *paths):
    """Templates of modules that a text holds nowhere, with the module."""
    return [(path.name, one) for path in paths for one in sorted(templates(path)) if not _said(one, text)]


def _said(template, text):
    parts = [re.escape(part) for part in template.strip("{} \n").split("{}")]
    return re.search(VALUE.join(parts), text) is not None


def picture_text(result, path):
    """Every text of the recording of a run, of its layout too, read back from the file."""
    write_recording(result, path)
    return recording_text(path)


def recording_text(path):
    """Every text of a recording, of its layout too."""
    reader = RrdReader(path)
    found = []
    for store in (*reader.blueprints(), *reader.recordings()):
        for chunk in reader.stream(store=store).to_chunks():
            batch = chunk.to_record_batch()
            for column in batch.columns:
                if "string" in str(column.type):
                    found += _texts(column.to_pylist())
    return "\n".join(found)


def _texts(values):
    for value in values or ():
        yield from [value] if isinstance(value, str) else _texts(value)
