"""Options that mean the same on every verb, and the words a verb says to people."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, TypeVar

import click

Command = TypeVar("Command", bound=Callable[..., Any])

SESSION_FILE = click.Path(exists=True, dir_okay=False, path_type=Path)
ANY_PATH = click.Path(path_type=Path)


def common(command: Command) -> Command:
    """``-v -q --debug``: how much is said; every verb has them."""
    for option in reversed(
        (
            click.option("-v", "--verbose", is_flag=True, help="Say more: notes about the poses, settings, digests."),
            click.option("-q", "--quiet", is_flag=True, help="Say nothing on stderr but errors."),
            click.option("--debug", is_flag=True, help="Show where an error happened."),
        )
    ):
        command = option(command)
    return command


def output_format(command: Command) -> Command:
    """``--format text|json``: what stdout carries."""
    return click.option(
        "--format",
        "format_",
        type=click.Choice(["text", "json"]),
        default="text",
        show_default=True,
        help="What to print on stdout.",
    )(command)


def lineup(command: Command) -> Command:
    """``--detectors --oracle --seed``: who looks, who is trusted, and what they draw from."""
    options = (
        click.option(
            "--detectors",
            "--detector",
            "detectors",
            multiple=True,
            metavar="SPEC",
            help="What to audit: hybrid-qaco, slow=discrete[rate_hz=22.5], package.module:Class; several with commas.",
        ),
        click.option(
            "--oracle", metavar="SPEC", help="The detector to trust: exact, continuous, a label. Default: exact."
        ),
        click.option("--seed", type=int, default=0, show_default=True, help="Of every random stream."),
    )
    for option in reversed(options):
        command = option(command)
    return command


def window(command: Command) -> Command:
    """``--start --end``: which part of the session."""
    command = click.option("--end", type=float, metavar="SECONDS", help="Leave out what comes after.")(command)
    return click.option("--start", type=float, metavar="SECONDS", help="Leave out what comes before.")(command)


def let_modules_here_be_found(specs: Iterable[str]) -> None:
    """Where a detector is named ``module:Class``, look for modules in the current folder too, after all others."""
    if any(":" in spec for spec in specs) and "" not in sys.path and str(Path.cwd()) not in sys.path:
        sys.path.append(str(Path.cwd()))
