"""Options that mean the same on every verb."""

import sys
from collections.abc import Callable, Iterable
from functools import wraps
from math import isfinite
from pathlib import Path
from typing import Any, TypeAlias

import click

from replay.cli.console import People
from sessions.input_files import special_kind

LARGEST = 1e9  # Of the numbers that an option takes; so many seconds are 32 years

Option: TypeAlias = Callable[[Callable[..., Any]], Callable[..., Any]]
"""What gives a command an option, or several."""


def together(*options: Option) -> Option:
    """These options as one, listed in this order by ``--help``."""

    def applied(command: Callable[..., Any]) -> Callable[..., Any]:
        for option in reversed(options):
            command = option(command)
        return command

    return applied


class Target(click.Path):
    """A path to be written; a name that no table or page could repeat is refused; with ``url`` it may be one."""

    def __init__(self, *, url: bool = False, **kind: bool) -> None:
        super().__init__(path_type=Path, **kind)
        self.url = url

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """As ``click.Path``, for names in UTF-8 without a NUL."""
        try:
            if b"\0" in str(value).encode():
                self.fail("a name of a file holds no NUL; name another", param, ctx)
        except UnicodeEncodeError:
            self.fail(f"{value!r} is not UTF-8; name another", param, ctx)
        if self.url and "://" in str(value):
            from replay.api.places import place

            return place(value)
        return self.local(value, param, ctx)

    def local(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """A path on this machine."""
        return super().convert(value, param, ctx)


class Existing(Target):
    """A path that exists; where the other kind of path is given, the error says what to do about it."""

    def __init__(self, *, folder: bool, file: bool | None = None, url: bool = False) -> None:
        super().__init__(url=url, exists=True, dir_okay=folder, file_okay=not folder if file is None else file)

    def local(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """As ``click.Path``, with a word on what to give instead."""
        path = Path(value)
        kind = special_kind(path)
        if kind and not path.is_dir():
            self.fail(f"{value} is {kind}; name a regular file", param, ctx)
        if path.is_dir() and not self.dir_okay:
            found = sorted(path.glob("*.mcap"))
            hint = f"name a file, like {found[0]}" if found else "name a file in it; it holds no *.mcap"
            self.fail(f"{value} is a folder; {hint}", param, ctx)
        if path.is_file() and not self.file_okay:
            self.fail(f"{value} is a file; replay it first: replay run {value} --out RUN", param, ctx)
        return super().local(value, param, ctx)


class Number(click.FloatRange):
    """A number within limits; nan, which is within any, and what no recording has are refused."""

    name = "number"

    def _describe_range(self) -> str:
        """Nothing for the help where there are no limits; click writes ``x<=None``."""
        return super()._describe_range() if (self.min, self.max) != (None, None) else ""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The number."""
        number = super().convert(value, param, ctx)
        if not abs(number) <= LARGEST:
            self.fail(f"{value} is no number" if not isfinite(number) else f"{value} is too large", param, ctx)
        return number


SHARE = Number(min=0.0, max=1.0)
SESSION_FILE = Existing(folder=False)
RUN_FOLDER = Existing(folder=True)
ANY_PATH = Target()
SESSION_ANYWHERE = Existing(folder=False, url=True)
SESSIONS_ANYWHERE = Existing(folder=True, file=True, url=True)
OUT_ANYWHERE = Target(url=True)


def common(command: Callable[..., int]) -> Callable[..., int]:
    """``-v -q --debug`` on every verb; the verb gets ``people``, to whom it speaks as much as was asked for."""

    @wraps(command)
    def spoken(*, verbose: bool, quiet: bool, debug: bool, **given: Any) -> int:
        del debug  # main looks for it among the arguments
        return command(people=People(quiet=quiet, verbose=verbose), **given)

    return together(
        click.option("-v", "--verbose", is_flag=True, help="Say more: tables, notes, settings, digests, sources."),
        click.option("-q", "--quiet", is_flag=True, help="Say nothing on stderr but errors."),
        click.option("--debug", is_flag=True, help="Show where an error happened."),
    )(spoken)


def answering(*formats: str) -> Option:
    """``--format`` and what ``common`` gives: the verb gets ``as_json``, what stdout carries, too.

    A verb that can write Markdown gets ``as_markdown`` besides.
    """

    def applied(command: Callable[..., int]) -> Callable[..., int]:
        @wraps(command)
        def chosen(*, format_: str, **given: Any) -> int:
            if MARKDOWN in formats:
                given["as_markdown"] = format_ == MARKDOWN
            return command(as_json=format_ == "json", **given)

        choice, words = click.Choice(formats), "What to print on stdout."
        return together(
            click.option("--format", "format_", type=choice, default="text", show_default=True, help=words),
            common,
        )(chosen)

    return applied


MARKDOWN = "markdown"
reporting = answering("text", "json")


def require_free(*files: Path, force: bool) -> None:
    """Refuse to replace files that are there, unless ``--force`` was given, before the work is done and not after."""
    from replay.errors import OutputError
    from sessions.whole_files import check_free

    for file in files:
        check_free(file, OutputError, force=force)


FILES_OR_FOLDERS = Existing(folder=True, file=True)
meshes = click.option(
    "--meshes", "place", type=FILES_OR_FOLDERS, metavar="DIR|FILE.glb", help="Meshes by the names of files or nodes."
)
SCENE_WORDS = "A scene in place of the session's own, of which nothing is kept."
scene = click.option("--scene", type=SESSION_FILE, metavar="SCENE.toml", help=SCENE_WORDS)
force = click.option("--force", is_flag=True, help="Replace an earlier file or folder of that name.")
seed = click.option("--seed", type=int, default=0, show_default=True, help="Of every random stream.")
tau = click.option("--tau", type=Number(min=0), default=2e-6, show_default=True, help="Metres of tolerance.")
jobs = click.option(
    "--jobs", type=click.IntRange(min=1), default=1, show_default=True, help="Workers of Dask on this machine."
)
scheduler = click.option("--scheduler", metavar="ADDRESS", help="Let the workers of a scheduler of Dask do it.")


workers = together(jobs, scheduler)
"""Who works, where there are several sessions."""
NOISE_WORDS = 'Ask noisy copies: [BODY=]vive or "0.3 mm, 0.05 deg, 0.1 s"; repeat it.'
noise = click.option("--noise", multiple=True, metavar="SIZE", help=NOISE_WORDS)
"""The tracker noise in spite of which contacts are to hold."""


def specs_named(context: click.Context, option: click.Parameter, value: str | tuple[str, ...] | None) -> Any:
    """One detector, or a list of them, as given; ``None`` if none is named."""
    del context, option
    specs = [value] if isinstance(value, str) else list(value or ())
    let_modules_here_be_found(specs)
    return value if isinstance(value, str) else specs or None


oracle = click.option(
    "--oracle", metavar="SPEC", callback=specs_named,
    help="The detector to trust: exact, continuous, a label. Default: exact.",
)  # fmt: skip


detectors = click.option(
    "--detectors", "--detector", "detectors", multiple=True, metavar="SPEC", callback=specs_named,
    help="Whom to ask: hybrid, slow=discrete[rate_hz=22.5], package.module:Class. Default: what engines ask.",
)  # fmt: skip


step_rate = click.option(
    "--step-rate", type=Number(min=0, min_open=True), metavar="HZ",
    help="Physics steps a second of your engine, where no detectors are named.  [default: 50]",
)  # fmt: skip
lineup = together(detectors, oracle, seed)
"""Who is asked, who is trusted; ``detectors`` is ``None`` if none is named."""


def gates(command: Callable[..., int]) -> Callable[..., int]:
    """``--max-missed --max-invented --max-p99-ms``: the verb gets ``limits``, the ``Gates`` to hold its result to."""

    @wraps(command)
    def held(*, max_missed: float | None, max_invented: float | None, max_p99_ms: float | None, **given: Any) -> int:
        from replay.pipeline.gates import Gates

        return command(limits=Gates(max_missed, max_p99_ms, max_invented), **given)

    missed, invented = "more contacts or pair-frames are missed", "more of the contact it reports is invented"
    late = "Exit 4 when the slowest 1 % of the looks take longer."
    return together(
        click.option("--max-missed", type=SHARE, metavar="SHARE", help=f"Exit 4 when {missed}."),
        click.option("--max-invented", type=SHARE, metavar="SHARE", help=f"Exit 4 when {invented}."),
        click.option("--max-p99-ms", type=Number(min=0), metavar="MS", help=late),
    )(held)


ACTIONS = "What to do with a kind of finding: drop, hold[:SECONDS], interpolate[:SECONDS], refuse, keep; repeat it."
window = together(
    click.option("--start", type=Number(), metavar="SECONDS", help="Leave out what comes before."),
    click.option("--end", type=Number(), metavar="SECONDS", help="Leave out what comes after."),
)
replaying = together(
    force, scene, window, tau, click.option("--policy", multiple=True, metavar="KIND=ACTION", help=ACTIONS),
    click.option("--no-picture", is_flag=True, help="Tables only, no recording for Rerun."),
)  # fmt: skip
"""What every verb takes that replays a session: which part of it, and what is trusted."""
auditing = together(lineup, step_rate, noise, workers, gates, replaying, answering("text", "json", MARKDOWN))
"""What ``run`` takes: of whom, how and by whom, with limits."""


def let_modules_here_be_found(specs: Iterable[str]) -> None:
    """Where a detector is named ``module:Class``, look for modules in the current folder too, after all others."""
    if any(":" in spec for spec in specs) and "" not in sys.path and str(Path.cwd()) not in sys.path:
        sys.path.append(str(Path.cwd()))
