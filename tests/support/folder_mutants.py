"""Run folders as anybody may send them: each a good one with one thing about it changed; a number is one for ever."""

import json
import random
import shutil

import pyarrow as pa
import pyarrow.parquet as pq

HUGE = "9" * 400
VALUES = [
    *(None, True, False, 0, 1, -1, 2**31, 2**63, 10**300, 0.5, -0.5, 1e308, -1e308, 1e-310),
    *("", "x", "../../x", "/etc/passwd", "os:system", "sent_along:Blind", "\n\x1b[31m", "<script>alert(1)</script>"),
    *([], {}, [1], [[]], [".."], ["../other"], ["/etc/passwd"], {"a": 1}, {"": {"": []}}, "é" * 5000),
]
TEXTS = ["NaN", "Infinity", "-Infinity", "1e999", HUGE, "-" + HUGE, "[" * 100_000, '{"a":' * 3000 + "1" + "}" * 3000]
MARK = "THE PLACE"
FIRST_WITH_PICTURES = 1004
"""From this number on the picture and the report are changed too."""
CELLS = {
    pa.types.is_string: ["", "x", "a", "none", "../..", "sent_along:Blind", "<b>", "\x00", "é" * 3000],
    pa.types.is_floating: [float("nan"), float("inf"), -float("inf"), -1.0, 0.0, 1e9, 1e308, -1e308, 5e-324],
    pa.types.is_boolean: [True, False],
    pa.types.is_integer: [-1, 0, 1, 2, 10**6, 2**31, 2**62, -(2**62)],
}
TYPES = [pa.string(), pa.int64(), pa.float64(), pa.bool_(), pa.list_(pa.int64()), pa.binary(), pa.null()]


def mutant(good, out, number):
    """Make the folder ``out``, the mutant of this number, and say what was changed."""
    chance = random.Random(number)
    shutil.copytree(good, out)
    changes = [summary, summary, summary, column, cells, cells, damage, removal]
    if number >= FIRST_WITH_PICTURES:
        changes += [damage_what_is_shown, damage_what_is_shown]
    return chance.choice(changes)(out, chance)


def summary(out, chance):
    """A value anywhere in the summary, as likely near its root as near its leaves, is gone or another one."""
    file = out / "summary.json"
    told = node = json.loads(file.read_text("utf-8"))
    key = "files" if chance.random() < 0.05 else None
    while key is None:
        at = chance.choice(list(node) if isinstance(node, dict) else range(len(node)))
        if isinstance(node[at], dict | list) and node[at] and chance.random() > 0.15:
            node = node[at]
        else:
            key = at
    text = chance.choice([None, None, *map(json.dumps, VALUES), *TEXTS])
    if text is None:
        del node[key]
    else:
        node[key] = MARK
    file.write_text(json.dumps(told).replace(f'"{MARK}"', str(text)), encoding="utf-8")
    return f"summary: {key} = {text or 'gone':.60}"


def table_of(out, chance):
    """A table of the folder, its words plain, and its file and one of its columns."""
    file = chance.choice(sorted(out.glob("*.parquet")))
    table = pq.read_table(file)
    plain = [part.cast(pa.string()) if pa.types.is_dictionary(part.type) else part for part in table.columns]
    table = pa.table(plain, table.column_names).replace_schema_metadata(table.schema.metadata)
    return file, table, chance.randrange(table.num_columns)


def column(out, chance):
    file, table, place = table_of(out, chance)
    name = table.column_names[place]
    changes = {
        "gone": lambda: table.remove_column(place),
        "twice": lambda: table.append_column(name, table.column(place)),
        "named x": lambda: table.rename_columns({name: "x"}),
        "of another type": lambda: table.set_column(place, name, pa.nulls(len(table), chance.choice(TYPES))),
    }
    what = chance.choice(list(changes))
    pq.write_table(changes[what](), file)
    return f"{file.name}: column {name} {what}"


def cells(out, chance):
    """A cell of a table is another one; now and then all rows are there twice, or none."""
    file, table, place = table_of(out, chance)
    name, values = table.column_names[place], table.column(place)
    wrong = next((some for is_kind, some in CELLS.items() if is_kind(values.type)), [])
    if len(table):
        row = chance.randrange(len(table))
        changed = values.to_pylist()
        changed[row] = chance.choice([*wrong, None])
        table = table.set_column(place, name, pa.array(changed, values.type))
    table = chance.choice([table, table, table, table, pa.concat_tables([table] * 2), table.slice(0, 0)])
    pq.write_table(table, file)
    return f"{file.name}: {name} {str(table.column(place))[-60:]}, {len(table)} rows"


def damage(out, chance):
    """A file of figures is cut short, or some of its bytes are others."""
    return damage_bytes(chance.choice(sorted([*out.glob("*.json"), *out.glob("*.parquet")])), chance)


def damage_what_is_shown(out, chance):
    """The picture or the report is cut short, or some of its bytes are others."""
    return damage_bytes(chance.choice(sorted([*out.glob("*.rrd"), *out.glob("*.html")])), chance)


def damage_bytes(file, chance):
    data = bytearray(file.read_bytes())
    if chance.random() < 0.5:
        data = data[: chance.randrange(len(data))]
    for _ in range(chance.choice([0, 1, 3, 20]) if data else 0):
        data[chance.randrange(len(data))] = chance.randrange(256)
    file.write_bytes(bytes(data))
    return f"{file.name}: bytes"


def removal(out, chance):
    """A file is gone, or a folder of its name is there."""
    file = chance.choice(sorted(out.iterdir()))
    file.unlink()
    if chance.random() < 0.5:
        file.mkdir()
    return f"{file.name} gone"
