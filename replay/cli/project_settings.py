"""``replay.toml`` beside the sessions: what ``run`` asks of all of them, so that nobody has to type it again.

A key is an option of ``run`` without its dashes, and an option on the command line comes first. The file may have come
with recordings of somebody else: it names rows of the table of detectors, and no code.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import click
from click.core import ParameterSource

SETTINGS_NAME: Final = "replay.toml"
GATES_TABLE: Final = "gates"
"""A table of the file whose keys are options too."""

SETTABLE_OPTIONS: Final = (
    "detectors",
    "oracle",
    "seed",
    "step-rate",
    "noise",
    "max-missed",
    "max-missed-depth",
    "max-false",
    "max-p99-ms",
    "start",
    "end",
    "tau",
    "policy",
)
"""Not those about one call, nor the path of a file: they stay on the command line."""


class ProjectCommand(click.Command):
    """A verb that takes what its command line leaves open from the file beside its sessions."""

    def invoke(self, ctx: click.Context) -> Any:
        """Fill in what the file says, and say so; then the verb."""
        file = settings_file(ctx.params["sessions"])
        if file is not None:
            settings = {
                name: value
                for name, value in read_settings(file, ctx).items()
                if ctx.get_parameter_source(name) == ParameterSource.DEFAULT
            }
            if ctx.params["detectors"]:
                settings.pop("step_rate", None)  # which is of the usual detectors
            ctx.params |= settings
            if settings and not ctx.params["quiet"]:
                click.echo(f"{file}: {', '.join(settings).replace('_', '-')}", err=True)
        return super().invoke(ctx)


def settings_file(sessions: Sequence[Path]) -> Path | None:
    """The file beside sessions, or in the folder of them; ``None``: there is none.

    Raises ``click.UsageError``: sessions of folders with different files.
    """
    from replay.running.remote_files import is_remote

    session_folders = dict.fromkeys(path if path.is_dir() else path.parent for path in sessions if not is_remote(path))
    files = [folder / SETTINGS_NAME for folder in session_folders if (folder / SETTINGS_NAME).exists()]
    if len(files) > 1:
        raise click.UsageError(f"{files[0]} and {files[1]} contradict each other; replay these folders one by one")
    return files[0] if files else None


def read_settings(file: Path, ctx: click.Context) -> dict[str, Any]:
    """Parameter -> value, as the option of that name takes it; ``click.UsageError``: one sentence for each mistake."""
    from sessions.errors import SceneError
    from sessions.input_files import nearest, parse_toml, read_text

    try:
        text = read_text(file, "settings", SceneError, may_be_empty=True)
        toml_values = parse_toml(text, str(file), SceneError).rest()
    except SceneError as error:
        raise click.UsageError(str(error)) from error
    gate_values = toml_values.pop(GATES_TABLE, {})
    if not isinstance(gate_values, dict):
        raise click.UsageError(
            f"{file}: {GATES_TABLE} is no table; write [{GATES_TABLE}] and below it max-missed = 0.01"
        )
    options = {option.opts[0].removeprefix("--"): option for option in ctx.command.params}
    settings = {}
    for key, value in {**toml_values, **gate_values}.items():
        if key == "max-invented":
            raise click.UsageError(f"{file}: max-invented is called max-false now")
        if key not in SETTABLE_OPTIONS:
            raise click.UsageError(f"{file}: no setting {key!r}{nearest(key, SETTABLE_OPTIONS)}")
        option = options[key]
        try:
            settings[str(option.name)] = option.process_value(ctx, _as_typed(key, value, takes_several=option.multiple))
        except click.BadParameter as error:
            raise click.UsageError(f"{file}: {key} is {value!r}; {error.message}") from error
    return settings


def _as_typed(key: str, toml_value: Any, *, takes_several: bool) -> str | tuple[str, ...]:
    """A value of TOML in the words of a command line, which the option converts and checks."""
    toml_values = toml_value if takes_several and isinstance(toml_value, list) else [toml_value]
    if not all(type(element) in (str, int, float) for element in toml_values):
        raise click.BadParameter("give a text or a number")
    value_texts = tuple(map(str, toml_values))
    if key in ("detectors", "oracle") and ":" in "".join(value_texts):
        raise click.BadParameter(f"code of your own is named on the command line: --{key} {' '.join(value_texts)}")
    return value_texts if takes_several else value_texts[0]
