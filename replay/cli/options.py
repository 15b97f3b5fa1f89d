"""Options that mean the same on every verb, and the words a verb says to people."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, TypeVar

import click

Command = TypeVar("Command", bound=Callable[..., Any])


class SessionFile(click.Path):
    """A file that exists; a folder in its place is answered with a session in it."""

    def __init__(self) -> None:
        super().__init__(exists=True, dir_okay=False, path_type=Path)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """As ``click.Path``, with a word on what to give."""
        if Path(value).is_dir():
            found = sorted(Path(value).glob("*.mcap"))
            hint = f"name a file, like {found[0]}" if found else "name a file in it; it holds no *.mcap"
            self.fail(f"{value} is a folder; {hint}", param, ctx)
        return super().convert(value, param, ctx)


class RunFolder(click.Path):
    """A folder that exists; a file in its place is answered with how a run comes of it."""

    def __init__(self) -> None:
        super().__init__(exists=True, file_okay=False, path_type=Path)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """As ``click.Path``, with a word on what to do."""
        if Path(value).is_file():
            self.fail(f"{value} is a file; replay it first: replay run {value} --out RUN", param, ctx)
        return super().convert(value, param, ctx)


SESSION_FILE = SessionFile()
RUN_FOLDER = RunFolder()
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
