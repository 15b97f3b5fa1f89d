"""The words of every output of a run."""

import re
from dataclasses import replace
from html import unescape
from io import StringIO
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from rich.console import Console
from support.sentences import recording_text

from replay import run, synthetic_session
from replay.cli.run_markdown import run_markdown
from replay.cli.run_report import where_to_look
from replay.cli.run_tables import run_screen, run_tables

FORBIDDEN = (
    "in part", "look phase", "counted apart", "like with like", "its solids meet", "being right costs",
    "pair-frames left out",
)  # fmt: skip
KEYS = {"contacts_in_part"}
"""Keys of JSON and columns of tables are no sentences."""


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    """The first seconds of the demo, in a folder."""
    session, _ = synthetic_session("bench-bumps")
    return run(session, end=14.0, out=tmp_path_factory.mktemp("demo") / "run")


def screen(demo, width):
    there = replace(demo, out=Path("runs/demo"))
    where = [text.replace(str(demo.out), "runs/demo") for text in where_to_look(demo)]
    return printed(run_screen(there, where, recording="runs/demo/session.mcap"), width)


def printed(shown, width):
    console = Console(width=width, file=StringIO())
    console.print(shown)
    return console.file.getvalue()


def values(data):
    """Every text in plain data that is a value, not a key."""
    if isinstance(data, str):
        yield data
    elif isinstance(data, dict):
        for value in data.values():
            yield from values(value)
    elif isinstance(data, list | tuple):
        for value in data:
            yield from values(value)


def outputs(demo):
    """Name of an output -> its text."""
    texts = {f"terminal {width}": screen(demo, width) for width in (60, 80, 100, 140)}
    texts["-v"] = printed(run_tables(demo), 100)
    texts["markdown"] = run_markdown(demo, ())
    texts["summary"] = "\n".join(values(dict(demo.summary)))
    page = (demo.out / "report.html").read_text(encoding="utf-8")
    texts["report"] = unescape(re.sub(r"<(style|script|svg).*?</\1>|<[^>]+>", " ", page, flags=re.DOTALL))
    for file in demo.out.glob("*.parquet"):
        columns = pq.read_table(file).columns
        texts[file.name] = "\n".join(cell for one in columns for cell in set(one.to_pylist()) if isinstance(cell, str))
    texts["picture"] = recording_text(demo.out / "run.rrd")
    return texts


def test_no_output_speaks_a_language_of_its_own(demo):
    found = [
        (name, phrase, text[max(0, place - 40) : place + 60])
        for name, text in outputs(demo).items()
        for phrase in FORBIDDEN
        if (place := " ".join(text.lower().split()).find(phrase)) >= 0
    ]
    assert found == []


def test_oracle_is_the_word_of_an_option_and_of_keys_and_asked_heads_no_column(demo):
    for name, text in outputs(demo).items():
        sentences = re.sub(r"--oracle\b|oracle=", "", text)
        assert "oracle" not in sentences.lower(), (name, sentences[sentences.lower().index("oracle") - 60 :][:120])
        heads = [] if name == "picture" else re.findall(r"(?m)(?:^|\s\s|\|) *asked *(?:\||\s\s|$)", sentences)
        assert heads == [], name


@pytest.mark.parametrize("width", [60, 80, 100, 140])
def test_the_screen_fits_and_ends_in_why_fix_cost_and_the_next_command(demo, width):
    lines = [text.rstrip() for text in screen(demo, width).splitlines()]
    if width >= 80:
        assert len(lines) <= 22 and max(map(len, lines)) <= 80
    heads = [text.split("  ")[0].strip() or text.split()[0] for text in lines if re.match("  [A-Z]|See|Read", text)]
    order = [head for head in heads if head in ("Why", "Fix", "Cost", "See it", "Read it")]
    assert order == ["Why", "Fix", "Cost", "See it", "Read it"]
