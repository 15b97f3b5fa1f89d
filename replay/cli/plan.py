"""``replay plan``: what a scene calls for, and why."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import click

from replay.cli.console import People, answer
from replay.cli.options import SESSION_FILE, reporting
from replay.cli.options import scene as scene_option
from sessions.model.scene import Scene


@click.command()
@click.argument("session", type=SESSION_FILE, metavar="SCENE")
@scene_option
@reporting
def command(session: Path, scene: Path | None, as_json: bool, people: People) -> int:
    """Say what SCENE, a scene.toml or a session file, calls for: effects, pairs, detectors, topics, each with why.

    \b
    replay plan scene.toml
    replay plan session.mcap --json
    """
    del people
    from replay.effects.effect_plan import plan
    from replay.effects.effect_summary import plan_summary

    file = scene or session
    declared = _scene(file)
    planned = plan_summary(plan(declared, file.name))
    answer(as_json, {"scene": declared.name, **planned}, lambda: [*plan_lines(declared.name, planned)])
    return 0


def _scene(path: Path) -> Scene:
    """The scene of a TOML file, or the one that a session carries."""
    if path.suffix.lower() == ".mcap":
        from sessions.mcap_format.reader import read_session

        return read_session(path).scene
    from sessions.scene_files.scene_toml import read_scene

    return read_scene(path)


BRANCHES = (
    ("effects", "effects, in running order", "no effect is declared"),
    ("pairs", "pairs", "no collision query is made"),
    ("detectors", "detectors", "none is needed"),
    ("bodies", "bodies", "no effect names one"),
    ("topics", "topics read", "none for effects"),
)
"""Key of a plan's summary, its title, and what is said where it is empty."""
LEFT = (("not_run", "not run"), ("not_built", "declared, not computed by this version"))
ALL_PAIRS = "all with relative motion, because the scene declares neither effects nor pairs"


def plan_lines(name: str, planned: Mapping[str, Any]) -> Iterator[str]:
    """A plan's summary: below its heading every item stands with the reason why it is needed."""
    yield name or "scene"
    for key, title, none in BRANCHES:
        items = planned[key]
        yield f"  {title} ({len(items)})" if items else f"  {title}: {ALL_PAIRS if items is None else none}"
        yield from (f"    {item}: because {_reason(why)}" for item, why in (items or {}).items())
    yield from (f"  {title}: {', '.join(planned[key])}" for key, title in LEFT if planned[key])


def _reason(why: list[str]) -> str:
    """``contact needs it, and grasp``: sentences as they are, kinds as those that need the item."""
    kinds, said = [one for one in why if " " not in one], [one for one in why if " " in one]
    said += [f"{' and '.join(kinds)} {'needs' if len(kinds) == 1 else 'need'} it"] * bool(kinds)
    return ", ".join(said)
