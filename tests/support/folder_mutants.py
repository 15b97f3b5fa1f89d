"""Run folders as anybody may send them: each a good one with one thing about it changed; a number is one for ever."""

import json
import random
import shutil
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

TABLES = ("episodes.parquet", "misses.parquet", "false.parquet", "metrics.parquet", "events.parquet", "frames.parquet")
HUGE = "9" * 400
VALUES = [
    *(None, True, False, 0, 1, -1, 2**31, 2**63, 10**300, 0.5, -0.5, 1e308, 1e-310),
    *("", "x", "../../x", "/etc/passwd", "os:system", "sent_along:Blind", "\n\x1b[31m", "<script>alert(1)</script>"),
    *([], {}, [1], [[]], {"a": 1}, {"": {"": []}}, "é" * 5000),
]
TEXTS = ["NaN", "Infinity", "-Infinity", "1e999", HUGE, "-" + HUGE, "[" * 100_000, '{"a":' * 3000 + "1" + "}" * 3000]
NUMBERS = [-1, 0, 1, 2, 10**6, 2**31, 2**62, -(2**62)]
FLOATS = [float("nan"), float("inf"), -float("inf"), -1.0, 0.0, 1e9, 1e308, -1e308, 5e-324]
WORDS = ["", "x", "a", "none", "../..", "sent_along:Blind", "<b>", "\x00", "é" * 3000]
TYPES = [pa.string(), pa.int64(), pa.float64(), pa.bool_(), pa.list_(pa.int64()), pa.binary(), pa.null()]


def mutant(good: Path, out: Path, number: int) -> str:
    """Make the folder ``out``, the mutant of this number, and say what was changed."""
    chance = random.Random(number)
    shutil.copytree(good, out)
    kind = chance.choice([_value, _value, _value, _key, _text, _files, _column, _cells, _cells, _cells, _bytes, _gone])
    return kind(out, chance)


def _summary(out):
    return json.loads((out / "summary.json").read_text(encoding="utf-8"))


def _place(node, chance):
    """Somewhere in the tree, as likely near its root as near its leaves: what holds it, and its key."""
    while True:
        key = chance.choice(list(node) if isinstance(node, dict) else range(len(node)))
        below = node[key]
        if not isinstance(below, dict | list) or not below or chance.random() < 0.15:
            return node, key
        node = below


def _value(out, chance):
    told = _summary(out)
    node, key = _place(told, chance)
    node[key] = chance.choice(VALUES)
    (out / "summary.json").write_text(json.dumps(told), encoding="utf-8")
    return f"summary: {key} = {node[key]!r:.60}"


def _key(out, chance):
    told = _summary(out)
    node, key = _place(told, chance)
    del node[key]
    (out / "summary.json").write_text(json.dumps(told), encoding="utf-8")
    return f"summary: without {key}"


def _text(out, chance):
    told, mark = _summary(out), "THE PLACE"
    node, key = _place(told, chance)
    node[key] = mark
    text = chance.choice(TEXTS)
    (out / "summary.json").write_text(json.dumps(told).replace(f'"{mark}"', text), encoding="utf-8")
    return f"summary: {key} = {text:.20}"


def _files(out, chance):
    told = _summary(out)
    told["files"] = chance.choice(
        [[".."], ["../other"], ["."], [""], ["/etc/passwd"], "summary.json", [3], None, {}, [[]]]
    )
    (out / "summary.json").write_text(json.dumps(told), encoding="utf-8")
    return f"files = {told['files']}"


def _table(out, chance):
    name = chance.choice([one for one in TABLES if (out / one).is_file()])
    table = pq.read_table(out / name)
    plain = [pa.types.is_dictionary(one.type) for one in table.schema]
    columns = [table.column(k).cast(pa.string()) if is_word else table.column(k) for k, is_word in enumerate(plain)]
    return name, pa.table(columns, table.column_names).replace_schema_metadata(table.schema.metadata)


def _column(out, chance):
    name, table = _table(out, chance)
    place = chance.randrange(table.num_columns)
    column = table.column_names[place]
    what = chance.choice(["gone", "type", "twice", "named"])
    if what == "gone":
        table = table.remove_column(place)
    elif what == "twice":
        table = table.append_column(column, table.column(place))
    elif what == "named":
        table = table.rename_columns([chance.choice(WORDS[1:]) if one == column else one for one in table.column_names])
    else:
        type_ = chance.choice(TYPES)
        table = table.set_column(place, column, pa.nulls(len(table), type_))
    pq.write_table(table, out / name)
    return f"{name}: column {column} {what}"


def _cells(out, chance):
    name, table = _table(out, chance)
    if not len(table):
        return _key(out, chance)
    place, row = chance.randrange(table.num_columns), chance.randrange(len(table))
    column, values = table.column(place), table.column(place).to_pylist()
    if pa.types.is_string(column.type):
        values[row] = chance.choice([*WORDS, None])
    elif pa.types.is_floating(column.type):
        values[row] = chance.choice([*FLOATS, None])
    elif pa.types.is_boolean(column.type):
        values[row] = chance.choice([True, False, None])
    else:
        values[row] = chance.choice([*NUMBERS, None])
    table = table.set_column(place, table.column_names[place], pa.array(values, column.type))
    if chance.random() < 0.2:
        table = pa.concat_tables([table] * chance.choice([2, 3])) if chance.random() < 0.8 else table.slice(0, 0)
    pq.write_table(table, out / name)
    return f"{name}: {table.column_names[place]} = {values[row]!r:.40}, {len(table)} rows"


def _bytes(out, chance):
    file = chance.choice([one for one in sorted(out.iterdir()) if one.suffix in (".json", ".parquet")])
    data = bytearray(file.read_bytes())
    if chance.random() < 0.5:
        data = data[: chance.randrange(len(data))]
    else:
        for _ in range(chance.choice([1, 3, 20])):
            data[chance.randrange(len(data))] = chance.randrange(256)
    file.write_bytes(bytes(data))
    return f"{file.name}: bytes"


def _gone(out, chance):
    file = chance.choice(sorted(out.iterdir()))
    file.unlink()
    if chance.random() < 0.5:
        file.mkdir()
    return f"{file.name} gone"
