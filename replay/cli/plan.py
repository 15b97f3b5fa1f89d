"""``replay plan``: what a scene calls for, and why."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from replay.cli.console import People, answer
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
    answer(as_json, {"scene": declared.name, **planned}, lambda: plan_tree(declared.name, planned))
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
    for key, title, none in BRANCHES:
        if planned[key] is None:
            tree.add("pairs: all with relative motion, because the scene declares neither effects nor pairs")
        else:
            _branch(tree, title, planned[key], none)
    left = (("not_run", "not run: ", "dim"), ("not_built", "declared, not computed by this version: ", "yellow"))
    for key, title, style in left:
        if planned[key]:
            tree.add(Text(title, style=style).append(", ".join(planned[key])))
    return tree


BRANCHES = (
    ("effects", "effects, in running order", "no effect is declared"),
    ("pairs", "pairs", "no collision query is made"),
    ("detectors", "detectors", "none is needed"),
    ("bodies", "bodies", "no effect names one"),
    ("topics", "topics read", "none for effects"),
)
"""Key of a plan's summary, its title, and what is said where it is empty."""


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
