"""A plan as a tree for a terminal: every item stands with the reason why it is needed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rich.text import Text
from rich.tree import Tree


def plan_tree(name: str, told: Mapping[str, Any]) -> Tree:
    """The tree of a plan's summary (``replay.effect_summary.plan_summary``)."""
    tree = Tree(Text(name or "scene", style="bold"))
    _branch(tree, "effects, in running order", told["effects"], "no effect is declared")
    if told["pairs"] is None:
        tree.add(Text("pairs: all with relative motion, because the scene declares neither effects nor pairs"))
    else:
        _branch(tree, "pairs", told["pairs"], "no collision query is made")
    _branch(tree, "detectors", told["detectors"], "none is needed")
    _branch(tree, "bodies", told["bodies"], "no effect names one")
    _branch(tree, "topics read", told["topics"], "none for effects")
    if told["not_run"]:
        tree.add(Text("not run: ", style="dim").append(", ".join(told["not_run"])))
    if told["not_built"]:
        tree.add(Text("declared, not computed by this version: ", style="yellow").append(", ".join(told["not_built"])))
    return tree


def _branch(tree: Tree, title: str, items: Mapping[str, list[str]], none: str) -> None:
    if not items:
        tree.add(Text(f"{title}: {none}", style="dim"))
        return
    branch = tree.add(Text(f"{title} ({len(items)})"))
    for name, why in items.items():
        branch.add(Text(f"{name}: because ").append(_reason(why), style="dim"))


def _reason(why: list[str]) -> str:
    """``contact needs it, and grasp``: sentences as they are, kinds as those that need the item."""
    if all(" " in one for one in why):
        return ", ".join(why)
    kinds = [one for one in why if " " not in one]
    rest = [one for one in why if " " in one]
    return ", ".join([*rest, f"{' and '.join(kinds)} {'needs' if len(kinds) == 1 else 'need'} it"])
