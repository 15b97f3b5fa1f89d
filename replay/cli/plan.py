"""``replay plan``: what a scene calls for, and why."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from replay.cli.console import stdout_console
from replay.cli.options import SESSION_FILE, common, output_format

if TYPE_CHECKING:
    from sessions.scene import Scene


@click.command()
@click.argument("scene", type=SESSION_FILE, metavar="SCENE")
@click.option("--json", "as_json", is_flag=True, help="The same as --format json.")
@output_format
@common
def command(scene: Path, as_json: bool, format_: str, verbose: bool, quiet: bool, debug: bool) -> int:
    """Say what SCENE, a scene.toml or a session file, calls for: effects, pairs, detectors, topics, each with why.

    \b
    replay plan scene.toml
    replay plan session.mcap --json
    """
    del verbose, quiet, debug
    from replay.effect_summary import plan_summary
    from replay.plan import plan

    declared = _scene(scene)
    told = plan_summary(plan(declared, scene.name))
    if as_json or format_ == "json":
        click.echo(json.dumps({"scene": declared.name, **told}, indent=1))
    else:
        from replay.cli.plan_tables import plan_tree

        stdout_console().print(plan_tree(declared.name, told))
    return 0


def _scene(path: Path) -> Scene:
    """The scene of a TOML file, or the one that a session carries."""
    if path.suffix.lower() == ".mcap":
        from sessions.mcap_format.reader import read_session

        return read_session(path).scene
    from sessions.scene_toml import read_scene

    return read_scene(path)
