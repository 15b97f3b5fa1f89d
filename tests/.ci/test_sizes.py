"""The counter of verbs and options counts what help shows, below groups too, and no more."""

import click
from support.processes import script

SIZES = vars(script("sizes"))


def test_sizes_count_options_of_commands_without_common_or_hidden():
    """The command ``study page`` has --out and a yes/no switch, which count as two options.

    Left out are a hidden option and a hidden command, the argument, and ``-v`` and ``--format``, which all commands
    have. "x" is what the program is called by.
    """
    replay_group, study = click.Group("replay"), click.Group("study")
    flags = [("--out", "-o"), ("--quick/--full",), ("-v", "--verbose"), ("--format", "format_")]
    options = [*map(click.Option, flags), click.Option(["--old"], hidden=True), click.Argument(["file"])]
    study.add_command(click.Command("page", params=options))
    replay_group.add_command(study)
    replay_group.add_command(click.Command("audit", hidden=True))
    ((name, command),) = SIZES["leaves"](replay_group, "x")
    assert name == "x study page"
    assert SIZES["own_options"](command) == ["--out", "--quick"]


def test_neither_comments_nor_docstrings_nor_layout_are_tokens():
    """A function in a line, and the same with docstrings, a comment and line breaks: both have its ten tokens.

    They are def, f, (, a, ), :, return, a, + and 1.
    """
    dense = "def f(a): return a + 1\n"
    separate = '"""A module."""\n\n\ndef f(a):  # fmt: skip\n    """Add."""\n    # why\n    return a + 1\n'
    assert SIZES["count_tokens"](dense) == SIZES["count_tokens"](separate) == 10


def test_sizes_count_unformatted_lines_and_parameters():
    """A line that the formatter must leave alone (``fmt: skip``), and a function of one parameter."""
    source = "def f(a):  # fmt: skip\n    return a + 1\n"
    assert SIZES["skipped_lines"](source) == 1
    assert SIZES["parameter_counts"](source) == [1]
