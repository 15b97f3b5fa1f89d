"""``replay scene``: a first scene of a recording, and everything that is wrong with one."""

import os
from pathlib import Path

import click

from replay.cli.console import FAILURE, OK, People, answer
from replay.cli.options import ANY_PATH, SESSION_FILE, force, meshes, reporting, require_free


@click.group()
def command() -> None:
    """Write a first scene of a recording, to edit; find every fault of a scene."""


@command.command()
@click.argument("session", type=SESSION_FILE, metavar="FILE.mcap")
@click.option("--out", "-o", type=ANY_PATH, metavar="SCENE.toml", help="File to write. Default: beside the recording.")
@meshes
@force
@reporting
def new(session: Path, out: Path | None, place: Path | None, force: bool, as_json: bool, people: People) -> int:
    """Write a first scene of FILE.mcap, to edit: bodies, pairs that came near, what is held, what stands on what.

    \b
    replay scene new session.mcap -o bench.toml
    replay run session.mcap --scene bench.toml --out runs/bench
    """
    from replay.errors import OutputError
    from replay.outputs.words import counted
    from replay.prepare.scene_draft import draft_text, drafted
    from sessions import read_session
    from sessions.meshes.mesh_match import matched
    from sessions.scene_files.scene_meshes import with_meshes
    from sessions.whole_files import whole_file

    target = out or session.with_suffix(".toml")
    require_free(target, force=force)
    held = read_session(session)
    found, said = ({}, []) if place is None else matched(place, held.names)
    held = with_meshes(held, {name: one.mesh for name, one in found.items()}, [])
    files = {name: (_beside(one.file, target), one.node, one.scale) for name, one in found.items()}
    draft = drafted(held)
    heading = f"A first scene of {session.name}, to edit; `replay scene check` names what is wrong with it."
    with whole_file(target, OutputError, overwrite=force, parents=True) as file:
        file.write(draft_text(held, draft, files, " ".join(heading.split())).encode())
    said += [one.words for one in found.values()]
    said += [f"{up} stands on {down} in {100 * share:.0f} % of it" for (up, down), share in draft.stands.items()]
    said += [f"moved together throughout: {', '.join(group)}" for group in draft.held]
    bare = [name for name in held.names if name not in held.meshes]
    said += [f"no mesh: {', '.join(bare)}"] * bool(bare)
    people.say(f"{counted(len(draft.near), 'pair')} came near", *said)
    plain = {"out": str(target), "near": draft.near, "held": draft.held, "without_mesh": bare,
             "stands": [[*pair, share] for pair, share in draft.stands.items()]}  # fmt: skip
    answer(as_json, plain, lambda: str(target))
    return OK


def _beside(file: Path, scene: Path) -> str:
    """How a scene names a file: from where it lies itself, where both lie on one drive."""
    try:
        return Path(os.path.relpath(file.resolve(), scene.resolve().parent)).as_posix()
    except ValueError:  # on Windows, another drive
        return file.resolve().as_posix()


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
    from sessions.input_files import read_text
    from sessions.scene_files.scene_meshes import checked_scene

    text = read_text(scene, "scene", SceneError)
    declared, _, faults = checked_scene(text, scene.name, plan_faults, scene.parent)
    effects = counted(len(declared.effects or ()), "effect")
    fine = f"{scene.name}: no fault in {counted(len(declared.bodies), 'body', 'bodies')} and {effects}"
    answer(as_json, {"file": str(scene), "faults": faults}, lambda: faults or [fine])
    return FAILURE if faults else OK
