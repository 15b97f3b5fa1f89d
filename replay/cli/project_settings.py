"""``replay.toml`` beside the sessions: what ``run`` asks of all of them, so that nobody has to type it again.

A key is an option of ``run`` without its dashes, and an option on the command line comes first. The file may have come
with recordings of somebody else: it names rows of the table of detectors, and no code.
"""

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any, Final

import click
from click.core import ParameterSource

from sessions.input_files import special_kind

NAME: Final = "replay.toml"
GATES: Final = ("max-missed", "max-invented", "max-p99-ms")
TABLE: Final = "gates"

ELSEWHERE: Final = frozenset(
    ("out", "view", "scene", "force", "no-picture", "format", "jobs", "scheduler", "verbose", "quiet", "debug", "help")
)
"""Options about one call, and the path of a file: they stay on the command line."""

LARGEST_BYTES: Final = 1 << 20


class ProjectCommand(click.Command):
    """A verb that takes what its command line leaves open from the file beside its sessions."""

    def invoke(self, ctx: click.Context) -> Any:
        """Fill in what the file says, and say so; then the verb."""
        file = settings_file(ctx.params["sessions"])
        if file is not None:
            settings, used = read_settings(file, self, ctx), list[str]()
            if ctx.params["detectors"]:
                settings.pop("step_rate", None)  # which is of the usual detectors
            for parameter, value in settings.items():
                if ctx.get_parameter_source(parameter) == ParameterSource.DEFAULT:
                    ctx.params[parameter] = value
                    used.append(parameter.replace("_", "-"))
            if used and not ctx.params["quiet"]:
                click.echo(f"{file}: {', '.join(used)}", err=True)
        return super().invoke(ctx)


def settings_file(given: Sequence[Path]) -> Path | None:
    """The file beside sessions, or in the folder of them; ``None``: there is none.

    Raises ``click.UsageError``: sessions of folders with different files.
    """
    from replay.api.places import far

    folders = dict.fromkeys(path if path.is_dir() else path.parent for path in given if not far(path))
    files = [folder / NAME for folder in folders if (folder / NAME).exists()]
    if len(files) > 1:
        raise click.UsageError(f"{files[0]} and {files[1]} ask for different things; replay these folders one by one")
    return files[0] if files else None


def read_settings(file: Path, command: click.Command, ctx: click.Context) -> dict[str, Any]:
    """Parameter -> value, as the option of that name takes it; ``click.UsageError``: one sentence for each mistake."""
    options = {
        name: one for one in command.params if isinstance(one, click.Option) and (name := _name(one)) not in ELSEWHERE
    }
    values = {}
    for name, value in _entries(file, _parsed(file), [*options]):
        option = options[name]
        try:
            values[str(option.name)] = option.process_value(ctx, _as_given(option, value))
        except click.BadParameter as error:
            raise click.UsageError(f"{file}: {name} is {value!r}; {error.message}") from error
    return values


def _name(option: click.Option) -> str:
    """The first long name without its dashes."""
    return next(name for name in option.opts if name.startswith("--")).removeprefix("--")


def _parsed(file: Path) -> Mapping[str, Any]:
    kind = special_kind(file)
    if kind or not file.is_file():
        raise click.UsageError(f"{file} is {kind or 'a folder'}; name a regular file so, or nothing")
    if file.stat().st_size > LARGEST_BYTES:
        raise click.UsageError(f"{file} is larger than any settings; name another file so")
    try:
        return tomllib.loads(file.read_text("utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise click.UsageError(f"{file} is no TOML ({error}); mend it or remove it") from error


def _entries(file: Path, parsed: Mapping[str, Any], names: Sequence[str]) -> Iterator[tuple[str, Any]]:
    """Names and values of the file; gates stand in a table of their own."""
    gates = parsed.get(TABLE, {})
    if not isinstance(gates, dict):
        raise click.UsageError(f"{file}: {TABLE} is no table; write [{TABLE}] and below it {GATES[0]} = 0.01")
    above = [name for name in names if name not in GATES]
    for key, value in parsed.items():
        if key in GATES:
            raise click.UsageError(f"{file}: {key} belongs into the table [{TABLE}]")
        if key != TABLE:
            yield _known(file, key, [*above, TABLE]), value
    for key, value in gates.items():
        yield _known(file, key, GATES), value


def _known(file: Path, key: str, names: Sequence[str]) -> str:
    if key in names:
        return key
    if key in ELSEWHERE:
        raise click.UsageError(f"{file}: {key} is no setting of a file; give --{key} on the command line")
    near = get_close_matches(key.replace("_", "-"), names, n=1)
    hint = f"did you mean {near[0]!r}?" if near else f"there are: {', '.join(names)}"
    raise click.UsageError(f"{file}: no setting {key!r}; {hint}")


def _as_given(option: click.Option, value: Any) -> Any:
    """A value of TOML as the words of a command line, which the option converts and checks."""
    values = value if isinstance(value, list) else [value]
    for one in values:
        if isinstance(one, bool) or not isinstance(one, str | int | float):
            raise click.BadParameter("give a text or a number")
        if option.name in ("detectors", "oracle") and ":" in str(one):
            raise click.BadParameter(f"code of your own is named on the command line: --{_name(option)} {one}")
    if option.multiple:
        return tuple(str(one) for one in values)
    if isinstance(value, list):
        raise click.BadParameter("give one value")
    return str(value)
