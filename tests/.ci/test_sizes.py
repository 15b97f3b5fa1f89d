"""The counter of verbs and options counts what help shows, below groups too, and no more."""

import click
from support.processes import script

SIZES = vars(script("sizes"))


def test_sizes_count_options_of_commands_without_common_or_hidden():
    """A yes/no switch is one option; left out are hidden ones, and ``-v`` and ``--format``, which all commands have."""
    top, study = click.Group("replay"), click.Group("study")
    flags = [("--out", "-o"), ("--quick/--full",), ("-v", "--verbose"), ("--format", "format_")]
    options = [*map(click.Option, flags), click.Option(["--old"], hidden=True), click.Argument(["file"])]
    study.add_command(click.Command("page", params=options))
    top.add_command(study)
    top.add_command(click.Command("audit", hidden=True))
    ((name, command),) = SIZES["leaves"](top, "x")
    assert (name, SIZES["own_options"](command)) == ("x study page", ["--out", "--quick"])


def test_neither_comments_nor_docstrings_nor_layout_are_tokens():
    dense = "def f(a): return a + 1\n"
    separate = '"""A module."""\n\n\ndef f(a):  # fmt: skip\n    """Add."""\n    # why\n    return a + 1\n'
    assert SIZES["count_tokens"](dense) == SIZES["count_tokens"](separate) == 10
    assert SIZES["skipped_lines"](separate) == 1 and SIZES["parameter_counts"](separate) == [1]
