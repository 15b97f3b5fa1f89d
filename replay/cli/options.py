"""Options that mean the same on every verb."""

import os
import re
import sys
from collections.abc import Callable, Iterable
from functools import wraps
from math import isfinite
from pathlib import Path
from typing import Any, TypeAlias

import click

from replay.cli.console import People
from sessions.input_files import special_kind

LARGEST_NUMBER = 1e9  # Of the numbers that an option takes; so many seconds are 32 years

OptionDecorator: TypeAlias = Callable[[Callable[..., Any]], Callable[..., Any]]
"""What gives a command an option, or several."""


def joined_options(*options: OptionDecorator) -> OptionDecorator:
    """These options as one, listed in this order by ``--help``."""

    def applied(command: Callable[..., Any]) -> Callable[..., Any]:
        for decorator in reversed(options):
            command = decorator(command)
        return command

    return applied


class FilePath(click.Path):
    """A path whose name every table and page can repeat; where it must exist, an error says what to give instead.

    With ``url`` a URL of fsspec does as well.
    """

    def __init__(self, *, url: bool = False, **kind: bool) -> None:
        super().__init__(path_type=Path, **kind)
        self.url = url

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Converts like ``click.Path``; refuses names that are not UTF-8."""
        path = Path(value)
        kind = special_kind(path)
        try:
            str(path).encode()
        except UnicodeEncodeError:
            self.fail(f"{value!r} is not UTF-8; name another", param, ctx)
        if self.url and "://" in str(value):
            from replay.running.remote_files import path_of_place

            return path_of_place(value)
        if not self.exists:
            return super().convert(value, param, ctx)
        if path.is_dir() and not self.dir_okay:
            files = sorted(path.glob("*.mcap"))
            hint = f"name a file, like {files[0]}" if files else "name a file in it; it holds no *.mcap"
            self.fail(f"{value} is a folder; {hint}", param, ctx)
        if kind and not path.is_dir():
            self.fail(f"{value} is {kind}; name a regular file", param, ctx)
        if path.is_file() and not self.file_okay:
            self.fail(f"{value} is a file; replay it first: replay run {value} --out RUN", param, ctx)
        return super().convert(value, param, ctx)


class Number(click.FloatRange):
    """A number within limits; nan, which is within any, and what no recording has are refused."""

    name = "number"

    def _describe_range(self) -> str:
        """Nothing for the help where there are no limits; click writes ``x<=None``."""
        return super()._describe_range() if (self.min, self.max) != (None, None) else ""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The number."""
        number = super().convert(value, param, ctx)
        if not abs(number) <= LARGEST_NUMBER:
            self.fail(f"{value} is {'too large' if isfinite(number) else 'no number'}", param, ctx)
        return number


class Share(Number):
    """A share between 0 and 1."""

    name = "share"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The share; for a count, such as 2 contacts, says how it is written."""
        try:
            number = float(value)
        except (TypeError, ValueError):
            number = 0.0
        if 1 < number <= LARGEST_NUMBER:
            self.fail(f"{value} is no share between 0 and 1; 2 of 50 contacts are 0.04", param, ctx)
        return super().convert(value, param, ctx)


class Length(click.ParamType):  # type: ignore[type-arg]
    """A length of 0 or more with its unit: ``2mm``, ``0.5 cm``; converted to metres."""

    name = "length"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return metres; refuse what is no length with a unit."""
        if isinstance(value, float):
            return value
        match = LENGTH_PATTERN.fullmatch(str(value))
        if match is None:
            self.fail(f"{value!r} is no length; write it with its unit: 2mm, 0.5cm or 0.002m", param, ctx)
        return float(match[1]) * LENGTH_UNITS[match[2]]


LENGTH_PATTERN = re.compile(r"\s*(\d+\.?\d*|\.\d+)\s*(um|mm|cm|m)\s*")
LENGTH_UNITS = {"um": 1e-6, "mm": 1e-3, "cm": 1e-2, "m": 1.0}

SHARE = Share(min=0.0, max=1.0)
ANY_PATH = FilePath()
SESSION_FILE = FilePath(exists=True, dir_okay=False)
RUN_FOLDER = FilePath(exists=True, file_okay=False)
FILE_OR_FOLDER = FilePath(exists=True)
SESSION_ANYWHERE = FilePath(exists=True, dir_okay=False, url=True)
SESSIONS_ANYWHERE = FilePath(exists=True, url=True)
OUT_ANYWHERE = FilePath(url=True)


def common(command: Callable[..., int]) -> Callable[..., int]:
    """``-v -q --debug`` on every verb; the verb gets ``people``, to whom it speaks as much as was asked for."""

    @wraps(command)
    def spoken(*, verbose: bool, quiet: bool, debug: bool, **given: Any) -> int:
        del debug  # main looks for it among the arguments
        return command(people=People(quiet=quiet, verbose=verbose), **given)

    return joined_options(
        click.option("-v", "--verbose", is_flag=True, help="Say more: tables, notes, settings, digests, sources."),
        click.option("-q", "--quiet", is_flag=True, help="Say nothing on stderr but errors."),
        click.option("--debug", is_flag=True, help="Show where an error happened."),
    )(spoken)


MARKDOWN = "markdown"


def format_options(*formats: str) -> OptionDecorator:
    """``--format`` and what ``common`` gives: the verb gets ``as_json`` too, and ``as_markdown`` if it can write it."""

    def applied(command: Callable[..., int]) -> Callable[..., int]:
        @wraps(command)
        def chosen(*, format_: str, **given: Any) -> int:
            if MARKDOWN in formats:
                given["as_markdown"] = format_ == MARKDOWN
            return command(as_json=format_ == "json", **given)

        help_text, choice = "Format of the standard output.", click.Choice(formats)
        option = click.option("--format", "format_", type=choice, default="text", show_default=True, help=help_text)
        return joined_options(option, common)(chosen)

    return applied


reporting = format_options("text", "json")


def require_free(*files: Path, overwrite: bool) -> None:
    """Refuse to replace files that are there, unless ``--force`` was given, before the work is done and not after."""
    from replay.errors import OutputError
    from sessions.whole_files import check_free

    for file in files:
        check_free(file, OutputError, force=overwrite)


meshes = click.option(
    "--meshes", type=FILE_OR_FOLDER, metavar="DIR|FILE.glb", help="Meshes by the names of files or nodes."
)
SCENE_HELP = "A scene in place of the session's own; without bodies it adds to that one."
scene = click.option("--scene", type=SESSION_FILE, metavar="SCENE.toml", help=SCENE_HELP)
TABLES_HELP = "Form of the tables for other programs; xlsx needs the extra `excel`."
force = click.option("--force", is_flag=True, help="Replace an earlier file or folder of that name.")


def tables(default: str) -> OptionDecorator:
    """Return the option for the form of the tables that are written."""
    table_format = click.Choice(["parquet", "csv", "xlsx"])
    return click.option("--tables", type=table_format, default=default, show_default=True, help=TABLES_HELP)


def _default_tau() -> float:
    from cdcore.tolerances import TWO_MICROMETRES

    return TWO_MICROMETRES


TAU_HELP = "Metres of tolerance."
tau = click.option("--tau", type=Number(min=0), default=_default_tau, show_default="2 micrometres", help=TAU_HELP)
jobs = click.option(
    "--jobs", type=click.IntRange(min=1), default=1, show_default=True, help="Workers of Dask on this machine."
)


def detectors_named(context: click.Context, option: click.Parameter, value: Any) -> Any:
    """One detector, or several, as given; ``None`` if none is named. Code of the current folder can be among them."""
    del context, option
    import_from_current_folder([value] if isinstance(value, str) else value or ())
    return value or None


ORACLE_HELP = "The detector to trust: exact, continuous, a label. Default: exact."
DETECTORS_HELP = (
    "Detectors to run: hybrid, slow=discrete[rate_hz=22.5], package.module:Class. Default: what engines ship."
)
lineup = joined_options(
    click.option(
        "--detectors",
        "--detector",
        "detectors",
        multiple=True,
        metavar="SPEC",
        callback=detectors_named,
        help=DETECTORS_HELP,
    ),
    click.option("--oracle", metavar="SPEC", callback=detectors_named, help=ORACLE_HELP),
    click.option("--seed", type=int, default=0, show_default=True, help="Seed of every random stream."),
)
"""Who is asked, who is trusted; ``detectors`` is ``None`` if none is named."""

FIX_SECONDS = 20.0
FIX_TIME_HELP = "Time to cut and replay a Fix of colliders; 0: none.  [default: 20; of several sessions 0]"
fix_time = click.option("--fix-time", type=Number(min=0), metavar="SECONDS", help=FIX_TIME_HELP)

PAIR_PATTERN = re.compile(r"((?:tag:)?[^:]+):((?:tag:)?[^:]+)")
PAIRS_HELP = 'Replay these pairs alone: bodies, groups, tag:WORD or patterns, as "hand:glass"; repeat it.'


def pairs_named(_: click.Context, __: click.Parameter, value: tuple[str, ...]) -> list[tuple[str, str]] | None:
    """The selectors at both ends of each pair; ``None`` if none is named."""
    text_matches = [(text, PAIR_PATTERN.fullmatch(text)) for text in value]
    for text, match in text_matches:
        if match is None:
            raise click.BadParameter(f"{text!r} is no pair; write two names with a colon between, like hand:glass")
    return [(match[1], match[2]) for _, match in text_matches if match is not None] or None


pairs = click.option("--pairs", multiple=True, metavar="A:B", callback=pairs_named, help=PAIRS_HELP)

POLICY_HELP = "Treatment of a kind of finding: drop, hold[:SECONDS], interpolate[:SECONDS], refuse, keep; repeat it."
replaying = joined_options(
    force,
    scene,
    pairs,
    click.option("--start", type=Number(), metavar="SECONDS", help="Leave out what comes before."),
    click.option("--end", type=Number(), metavar="SECONDS", help="Leave out what comes after."),
    tau,
    click.option("--policy", multiple=True, metavar="KIND=ACTION", help=POLICY_HELP),
    click.option("--no-picture", is_flag=True, help="Tables only, no recording for Rerun."),
)
"""What every verb takes that replays a session: which part of it, and what is trusted."""


def import_from_current_folder(specs: Iterable[str]) -> None:
    """Appends the current folder to the module path if a detector is named ``module:Class``.

    So are folders of ``PYTHONPATH`` that an isolated Python (``python -I``) left out.
    """
    if not any(":" in spec for spec in specs):
        return
    path_entries = os.environ.get("PYTHONPATH", "").split(os.pathsep)
    current_folder = str(Path.cwd())
    for folder in (*(str(Path(name).absolute()) for name in path_entries if name), current_folder):
        if folder not in sys.path and not (folder == current_folder and "" in sys.path):
            sys.path.append(folder)
