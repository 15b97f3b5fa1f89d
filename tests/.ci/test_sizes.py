"""The counter of verbs and options counts what help shows, below groups too, and no more."""

import runpy
from pathlib import Path

import click

SIZES = runpy.run_path(str(Path(__file__).resolve().parents[2] / ".ci" / "sizes.py"))


def made_up():
    @click.group()
    def top(): ...

    @top.command()
    @click.argument("file")
    @click.option("--out", "-o")
    @click.option("--quick/--full")
    @click.option("--old", hidden=True)
    @click.option("-v", "--verbose", is_flag=True)
    @click.option("--format", "format_")
    def run(): ...

    top.command("audit", hidden=True)(lambda: None)

    @top.group()
    def study(): ...

    study.command("page")(click.option("--seed")(lambda: None))
    study.command("check")(lambda: None)
    return top


def test_verbs_below_groups_count_and_hidden_ones_do_not():
    assert [name for name, _ in SIZES["leaves"](made_up(), "x")] == ["x run", "x study check", "x study page"]


def test_a_switch_is_one_option_and_what_every_verb_has_is_none():
    options = {name: SIZES["own_options"](command) for name, command in SIZES["leaves"](made_up(), "x")}
    assert options == {"x run": ["--out", "--quick"], "x study check": [], "x study page": ["--seed"]}


def test_neither_comments_nor_docstrings_nor_layout_are_tokens():
    dense = "def f(a): return a + 1\n"
    loose = '"""A module."""\n\n\ndef f(a):  # fmt: skip\n    """Add."""\n    # why\n    return a + 1\n'
    assert SIZES["count_tokens"](dense) == SIZES["count_tokens"](loose) == 10
    assert SIZES["skipped_lines"](loose) == 1 and SIZES["parameter_counts"](loose) == [1]
