"""``replay plan``: what a scene calls for, and why."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from replay.cli.console import People, stdout_console
from replay.cli.options import SESSION_FILE, common, json_flag, output_format

if TYPE_CHECKING:
    from rich.tree import Tree

    from sessions.model.scene import Scene


@click.command()
@click.argument("scene", type=SESSION_FILE, metavar="SCENE")
@json_flag
@output_format
@common
def command(scene: Path, as_json: bool, people: People) -> int:
    """Say what SCENE, a scene.toml or a session file, calls for: effects, pairs, detectors, topics, each with why.

    \b
    replay plan scene.toml
    replay plan session.mcap --json
    """
    del people
    from replay.effects.effect_plan import plan
    from replay.effects.effect_summary import plan_summary

    declared = _scene(scene)
    planned = plan_summary(plan(declared, scene.name))
    if as_json:
        click.echo(json.dumps({"scene": declared.name, **planned}, indent=1))
    else:
        stdout_console().print(plan_tree(declared.name, planned))
    return 0


def _scene(path: Path) -> Scene:
    """The scene of a TOML file, or the one that a session carries."""
    if path.suffix.lower() == ".mcap":
        from sessions.mcap_format.reader import read_session

        return read_session(path).scene
    from sessions.scene_files.scene_toml import read_scene

    return read_scene(path)


def plan_tree(name: str, planned: Mapping[str, Any]) -> Tree:
    """A plan's summary as a tree: every item stands with the reason why it is needed."""
    from rich.text import Text
    from rich.tree import Tree

    tree = Tree(Text(name or "scene", style="bold"))
    _branch(tree, "effects, in running order", planned["effects"], "no effect is declared")
    if planned["pairs"] is None:
        tree.add(Text("pairs: all with relative motion, because the scene declares neither effects nor pairs"))
    else:
        _branch(tree, "pairs", planned["pairs"], "no collision query is made")
    _branch(tree, "detectors", planned["detectors"], "none is needed")
    _branch(tree, "bodies", planned["bodies"], "no effect names one")
    _branch(tree, "topics read", planned["topics"], "none for effects")
    if planned["not_run"]:
        tree.add(Text("not run: ", style="dim").append(", ".join(planned["not_run"])))
    if planned["not_built"]:
        tree.add(
            Text("declared, not computed by this version: ", style="yellow").append(", ".join(planned["not_built"]))
        )
    return tree


def _branch(tree: Tree, title: str, items: Mapping[str, list[str]], none: str) -> None:
    from rich.markup import escape

    if not items:
        tree.add(f"[dim]{title}: {none}[/]")
        return
    branch = tree.add(f"{title} ({len(items)})")
    for name, why in items.items():
        branch.add(f"{escape(name)}: because [dim]{escape(_reason(why))}[/]")


def _reason(why: list[str]) -> str:
    """``contact needs it, and grasp``: sentences as they are, kinds as those that need the item."""
    if all(" " in one for one in why):
        return ", ".join(why)
    kinds = [one for one in why if " " not in one]
    rest = [one for one in why if " " in one]
    return ", ".join([*rest, f"{' and '.join(kinds)} {'needs' if len(kinds) == 1 else 'need'} it"])
