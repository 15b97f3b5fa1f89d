"""Changed records and bytes of files, changed run folders, and changed files of other programs.

A good file of another program comes back from its session file; each mutant of it is read or named in a sentence. So
many of each kind of file, where 120 are too few:
``IMPORT_MUTANTS=10000 python -m pytest -m slow tests/sessions tests/replay/cli/test_scene.py -k mutants``
"""

import json
import os
import random
import shutil
import struct
import sys
import time
import warnings
import zlib
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import zstandard
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.opcode import Opcode

from sessions import read_session, write_session
from sessions.errors import ImportFileError, SessionError
from sessions.importers import import_session
from sessions.importers.ledger import ledger_of

EXTREMES = [0, 1, 2**31 - 1, 2**32 - 1, 2**53, 2**63 - 1, 2**64 - 1]
"""Numbers that no file means."""
HEAD = struct.Struct("<BQ")
CHUNK = struct.Struct("<QQQII")
MESSAGE = struct.Struct("<HIQQ")


def records(data):
    """(opcode, start, end) of every record of a whole file."""
    at, result = 8, []
    while at + HEAD.size <= len(data) - 8:
        opcode, length = HEAD.unpack_from(data, at)
        result.append((opcode, at, at + HEAD.size + length))
        at = result[-1][2]
    return result


def chunks(data):
    """(start, end) of every chunk record."""
    return [(start, end) for opcode, start, end in records(data) if opcode == Opcode.CHUNK]


def split(data):
    """(opcode, content) of records in a row."""
    around = bytes(8)
    return [(opcode, data[start - 8 + HEAD.size : end - 8]) for opcode, start, end in records(around + data + around)]


def joined(pieces):
    """Bytes of these records."""
    return b"".join(HEAD.pack(opcode, len(content)) + content for opcode, content in pieces)


def opened(content):
    """Content of a chunk packed by zstd, or nothing."""
    at = CHUNK.size + CHUNK.unpack_from(content)[4]
    if content[CHUNK.size : at] != b"zstd":
        return b""
    return zstandard.ZstdDecompressor().decompress(content[at + 8 :], max_output_size=64 << 20)


def closed(plain):
    """The content of a chunk that holds these bytes, its checksum right."""
    packed = zstandard.ZstdCompressor(level=1).compress(plain)
    head = CHUNK.pack(0, 2**62, len(plain), zlib.crc32(plain), 4)
    return head + b"zstd" + struct.pack("<Q", len(packed)) + packed


def body_and_index(data):
    """The records of a file before its index, and the bytes from there on."""
    foot = int.from_bytes(data[-28:-20], "little") or len(data) - 37
    return split(data[8:foot]), data[foot:]


def without_index(pieces, mark, index_at=0):
    """A file of these records whose footer names no index, or one at a byte where there is none."""
    footer = HEAD.pack(Opcode.FOOTER, 20) + struct.pack("<QQI", index_at, 0, 0)
    return mark + joined(pieces) + footer + mark


def with_records(data, change):
    """A file whose records are changed, without an index."""
    return without_index(change(body_and_index(data)[0]), data[:8])


def with_messages(data, change, channel=None):
    """A file whose messages in chunks are changed, of all channels or of one: content -> content."""

    def changed(content):
        pieces = split(opened(content))
        messages = [
            (kind, change(item) if kind == Opcode.MESSAGE and channel in (None, MESSAGE.unpack_from(item)[0]) else item)
            for kind, item in pieces
        ]
        return closed(joined(messages))

    return with_records(
        data, lambda pieces: [(kind, changed(item) if kind == Opcode.CHUNK else item) for kind, item in pieces]
    )


def flipped(data, first, last, count, seed):
    """``count`` bytes between two places changed, every one to something else."""
    random = np.random.default_rng(seed)
    changed = bytearray(data)
    for at in random.choice(np.arange(first, last), min(count, last - first), replace=False).tolist():
        changed[at] ^= int(random.integers(1, 256))
    return bytes(changed)


@st.composite
def damaged(draw, data):
    """One to four times bytes are written over, put in, repeated or lost."""
    for _ in range(draw(st.integers(1, 4))):
        start = draw(st.integers(0, len(data)))
        end = min(len(data), start + draw(st.integers(0, 200)))
        noise = draw(st.binary(min_size=1, max_size=20))
        number = struct.pack("<Q", draw(st.sampled_from(EXTREMES)))[: draw(st.sampled_from([4, 8]))]
        start, put, end = draw(
            st.sampled_from(
                [
                    (start, noise, start + len(noise)),
                    (start, number, start + len(number)),
                    (start, noise, start),
                    (start, 5 * data[start:end], start),
                    (start, b"", end),
                    (start, b"", len(data)),
                ]
            )
        )
        data = data[:start] + put + data[end:]
    return data


@st.composite
def damaged_below_checksums(draw, data):
    """Damages bytes; in half of the session files those of a chunk's messages, and the checksum agrees again."""
    starts = chunks(data) if data.startswith(b"\x89MCAP") else []
    if not starts or draw(st.booleans()):
        return draw(damaged(data))
    start, end = draw(st.sampled_from(starts))
    content = closed(draw(damaged(opened(data[start + HEAD.size : end]))))
    return data[:start] + HEAD.pack(Opcode.CHUNK, len(content)) + content + data[end:]


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
        changes += [damage_what_is_displayed, damage_what_is_displayed]
    return chance.choice(changes)(out, chance)


def summary(out, chance):
    """A value anywhere in the summary, as likely near its root as near its leaves, is gone or another one."""
    file = out / "summary.json"
    reported = node = json.loads(file.read_text("utf-8"))
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
    file.write_text(json.dumps(reported).replace(f'"{MARK}"', str(text)), encoding="utf-8")
    return f"summary: {key} = {text or 'gone':.60}"


def table_of(out, chance):
    """A table of the folder, its words plain, and its file and one of its columns."""
    file = chance.choice(sorted(out.glob("*.parquet")))
    table = pq.read_table(file)
    plain = [piece.cast(pa.string()) if pa.types.is_dictionary(piece.type) else piece for piece in table.columns]
    table = pa.table(plain, table.column_names).replace_schema_metadata(table.schema.metadata)
    return file, table, chance.randrange(table.num_columns)


def column(out, chance):
    """A table without a column, with it twice, under another name or of another type."""
    file, table, position = table_of(out, chance)
    name = table.column_names[position]
    changes = {
        "gone": lambda: table.remove_column(position),
        "twice": lambda: table.append_column(name, table.column(position)),
        "named x": lambda: table.rename_columns({name: "x"}),
        "of another type": lambda: table.set_column(position, name, pa.nulls(len(table), chance.choice(TYPES))),
    }
    what = chance.choice(list(changes))
    pq.write_table(changes[what](), file)
    return f"{file.name}: column {name} {what}"


def cells(out, chance):
    """A cell of a table is another one; now and then all rows are there twice, or none."""
    file, table, position = table_of(out, chance)
    name, values = table.column_names[position], table.column(position)
    wrong = next((some for is_kind, some in CELLS.items() if is_kind(values.type)), [])
    if len(table):
        row = chance.randrange(len(table))
        changed = values.to_pylist()
        changed[row] = chance.choice([*wrong, None])
        table = table.set_column(position, name, pa.array(changed, values.type))
    table = chance.choice([table, table, table, table, pa.concat_tables([table] * 2), table.slice(0, 0)])
    pq.write_table(table, file)
    return f"{file.name}: {name} {str(table.column(position))[-60:]}, {len(table)} rows"


def damage(out, chance):
    """A file of figures is cut short, or some of its bytes are others."""
    return damage_bytes(chance.choice(sorted([*out.glob("*.json"), *out.glob("*.parquet")])), chance)


def damage_what_is_displayed(out, chance):
    """The picture or the report is cut short, or some of its bytes are others."""
    return damage_bytes(chance.choice(sorted([*out.glob("*.rrd"), *out.glob("*.html")])), chance)


def damage_bytes(file, chance):
    """Cuts a file or changes some of its bytes."""
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


MUTANTS = [3, pytest.param(int(os.environ.get("IMPORT_MUTANTS", "120")), marks=pytest.mark.slow)]
LONGEST_S = 10.0
FOR_WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT
CHANGES = frozenset(("os.mkdir", "os.rename", "os.remove", "os.rmdir", "os.link", "os.symlink"))
touched: list[str] = []


def _noted(event, arguments):
    """Note a file that the program changes."""
    if event in CHANGES or (event == "open" and isinstance(arguments[2], int) and arguments[2] & FOR_WRITING):
        touched.append(os.fsdecode(arguments[0]) if not isinstance(arguments[0], int) else "")


@cache
def note_changes():
    """Notes changes of files from here on; a hook, which no program can take back, slows whatever follows."""
    sys.addaudithook(_noted)


@contextmanager
def nothing_written(but=Path("none")):
    """Nothing anywhere is written, made, moved or removed, but the file named and its parts."""
    note_changes()
    touched.clear()
    yield
    compiled = sys.pycache_prefix or "__pycache__"
    paths = [Path(path) for path in touched if path and "__pycache__" not in path and compiled not in path]
    assert [path for path in paths if path.parent != but.parent or but.name not in path.name] == []


def round_trips(session, folder):
    """Every stamp, number and name of an import comes back from its file."""
    write_session(session, folder / "written.mcap")
    result = read_session(folder / "written.mcap")
    for piece in ("tracks", "fast_tracks", "hands", "gaze", "scalars"):
        expected = getattr(session, piece)
        assert list(getattr(result, piece)) == list(expected)
        for key, item in expected.items():
            for field, values in vars(item).items():
                np.testing.assert_array_equal(
                    vars(getattr(result, piece)[key])[field], values, err_msg=f"{key} {field}"
                )
    assert (result.events, result.intervals) == (session.events, session.intervals)


def ledger_text(session):
    """Losses and mergers in the ledger of an import."""
    return "; ".join(ledger_of(session.facts).sentences())


def assert_import_refused(name, path, words, **options):
    """It is refused in one sentence that holds these words (a pattern) and names the source, if the words do not."""
    with pytest.raises(ImportFileError, match=words) as raised:
        import_session(name, path, **options)
    assert str(raised.value).isprintable() and (path.name in str(raised.value) or "importer" in words)


def tried(path, count, read, source=None, out=Path("none")):
    """A result or one sentence that names the file, of this many mutants: quick, and nothing is written but ``out``."""
    data = path.read_bytes()

    @settings(max_examples=count, database=None, suppress_health_check=[*HealthCheck])
    @given(damaged_below_checksums(data))
    def each_is_read_or_named(mutant):
        path.write_bytes(mutant)
        began = time.process_time()
        with warnings.catch_warnings(), nothing_written(out):
            warnings.simplefilter("error", RuntimeWarning)
            try:
                read()
            except SessionError as error:
                assert str(source or path) in str(error) and str(error).isprintable(), str(error)
        assert time.process_time() - began < LONGEST_S

    each_is_read_or_named()
    path.write_bytes(data)


def survive(name, path, count, source=None, **options):
    """Import this many mutants of a file, also as what it looks like; what is accepted can be kept.

    ``source``: the folder to import where that is not the file.
    """
    out = path.parent.parent / "imported.mcap"
    with TemporaryDirectory() as folder:
        round_trips(import_session(name, source or path, **options), Path(folder))

    def imported():
        with suppress(SessionError):
            import_session("auto", source or path)
        session = import_session(name, source or path, **options)
        assert len(session.frames) and dict(session.facts)
        with suppress(SessionError):  # a session that no file holds
            write_session(session, out)
            assert sum(map(len, read_session(out).blocks())) == len(session.frames)

    tried(path, count, imported, source, out)
