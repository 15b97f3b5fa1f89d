"""``replay scene``: a first scene of a recording, and everything that is wrong with one."""

from pathlib import Path

import click

from replay.cli.console import FAILURE, OK, People, answer
from replay.cli.options import SESSION_FILE, reporting


@click.group()
def command() -> None:
    """Write a first scene of a recording, to edit; find every fault of a scene."""


@command.command()
@click.argument("scene", type=SESSION_FILE, metavar="SCENE.toml")
@reporting
def check(scene: Path, as_json: bool, people: People) -> int:
    """Say everything that is wrong with SCENE.toml: keys, bodies, meshes, pairs, effects. Exits with 1 on any fault.

    Whether it fits a recording says: replay doctor session.mcap --scene SCENE.toml

    \b
    replay scene check bench.toml
    """
    del people
    from replay.effects.effect_plan import plan_faults
    from replay.outputs.words import counted
    from sessions.errors import SceneError
    from sessions.scene_files.scene_check import checked_scene
    from sessions.scene_files.toml_table import read_text

    text = read_text(scene, "scene", SceneError)
    declared, _, faults = checked_scene(text, scene.name, plan_faults, scene.parent)
    effects = counted(len(declared.effects or ()), "effect")
    fine = f"{scene.name}: no fault in {counted(len(declared.bodies), 'body', 'bodies')} and {effects}"
    answer(as_json, {"file": str(scene), "faults": faults}, lambda: "\n".join(faults or [fine]))
    return FAILURE if faults else OK
