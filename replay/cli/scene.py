"""``replay scene``: a first scene of a recording; what is wrong with one, what it calls for; keys of effects."""

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import click

from replay.cli.console import EXIT_FAILURE, EXIT_OK, People, answer
from replay.cli.options import ANY_PATH, SESSION_FILE, force, reporting, require_free
from replay.cli.options import meshes as meshes_option
from sessions.model.scene import Scene


@click.group()
def command() -> None:
    """Draft the scene of a recording, to edit; check a scene, and list what it needs."""


@command.command()
@click.argument("session", type=SESSION_FILE, metavar="FILE.mcap")
@click.option("--out", "-o", type=ANY_PATH, metavar="SCENE.toml", help="File to write. Default: beside the recording.")
@meshes_option
@force
@reporting
def new(session: Path, out: Path | None, meshes: Path | None, force: bool, as_json: bool, people: People) -> int:
    """Write a first scene of FILE.mcap, to edit: bodies, pairs that came near, what is held.

    \b
    replay scene new session.mcap -o bench.toml
    replay run session.mcap --scene bench.toml --out runs/bench
    """
    from replay.errors import OutputError
    from replay.prepare.scene_draft import draft_scene, draft_text
    from replay.words import plural
    from sessions import read_session
    from sessions.meshes.mesh_match import match_meshes
    from sessions.scene_files.scene_meshes import with_meshes
    from sessions.whole_files import whole_file

    target = out or session.with_suffix(".toml")
    require_free(target, overwrite=force)
    session_read = read_session(session)
    mesh_matches, messages = ({}, []) if meshes is None else match_meshes(meshes, session_read.names)
    session_read = with_meshes(session_read, {name: match.mesh for name, match in mesh_matches.items()}, [])
    files = {
        name: (_relative_path(match.file, target), match.node, match.scale) for name, match in mesh_matches.items()
    }
    draft = draft_scene(session_read)
    heading = f"A first scene of {session.name}, to edit; `replay scene check` names what is wrong with it."
    with whole_file(target, OutputError, overwrite=force, parents=True) as file:
        file.write(draft_text(session_read, draft, files, " ".join(heading.split())).encode())
    messages += [match.sentence for match in mesh_matches.values()]
    messages += [f"moved together throughout: {', '.join(group)}" for group in draft.held]
    bodies_without_mesh = [name for name in session_read.names if name not in session_read.meshes]
    messages += [f"no mesh: {', '.join(bodies_without_mesh)}"] * bool(bodies_without_mesh)
    people.say(f"{plural(len(draft.near_pairs), 'pair')} came near", *messages)
    json_value = {"out": str(target), "near": draft.near_pairs, "held": draft.held, "without_mesh": bodies_without_mesh}
    answer(as_json, json_value, lambda: str(target))
    return EXIT_OK


def _relative_path(file: Path, scene: Path) -> str:
    """How a scene names a file: from where it lies itself, where both lie on one drive."""
    try:
        return Path(os.path.relpath(file.resolve(), scene.resolve().parent)).as_posix()
    except ValueError:  # on Windows, another drive
        return file.resolve().as_posix()


@command.command()
@click.argument("scene", type=SESSION_FILE, metavar="SCENE.toml|FILE.mcap")
@reporting
def check(scene: Path, as_json: bool, people: People) -> int:
    """Name every mistake in SCENE.toml: keys, bodies, meshes, pairs, effects. Exits with 1 on any mistake.

    A scene without mistakes, or the one in FILE.mcap, is listed with what it needs and why: effects, pairs, detectors,
    topics. To check that it fits a recording: replay doctor session.mcap --scene SCENE.toml

    \b
    replay scene check bench.toml
    """
    del people
    from replay.effects.effect_plan import plan
    from replay.effects.effect_summary import plan_summary
    from replay.words import plural

    declared, faults = _checked_scene(scene)
    if faults:
        answer(as_json, {"file": str(scene), "faults": faults}, lambda: faults)
        return EXIT_FAILURE
    effects = plural(len(declared.effects or ()), "effect")
    success_text = f"{scene.name}: no fault in {plural(len(declared.bodies), 'body', 'bodies')} and {effects}"
    plan_fields = plan_summary(plan(declared))
    json_value = {"file": str(scene), "faults": [], "scene": declared.name, **plan_fields}
    answer(as_json, json_value, lambda: [success_text, *plan_lines(declared.name, plan_fields)])
    return EXIT_OK


@command.command()
@click.argument("kind", required=False, metavar="[KIND]")
@reporting
def effects(kind: str | None, as_json: bool, people: People) -> int:
    """Print every key that a scene may declare of an effect: a value to copy, its meaning, unit and default.

    \b
    replay scene effects
    replay scene effects colour
    """
    del people
    from replay.effects.catalogue_text import catalogue_data, catalogue_lines

    kinds = () if kind is None else (kind,)
    answer(as_json, catalogue_data(kinds), lambda: list(catalogue_lines(kinds)))
    return EXIT_OK


def _checked_scene(file: Path) -> tuple[Scene, list[str]]:
    """The scene of a file, or the one that a session carries, and its faults; a session with any is refused."""
    from replay.effects.effect_plan import plan_faults
    from sessions.errors import SceneError
    from sessions.input_files import read_text
    from sessions.scene_files.scene_meshes import checked_scene

    if file.suffix.lower() == ".mcap":
        from sessions import read_session

        declared = read_session(file).scene
        return declared, [*plan_faults(declared)]
    declared, _, faults = checked_scene(read_text(file, "scene", SceneError), file.name, plan_faults, file.parent)
    return declared, [*faults]


PLAN_SECTIONS = (
    ("effects", "effects, in running order", "no effect is declared"),
    ("pairs", "pairs", "no collision query is made"),
    ("detectors", "detectors", "none is needed"),
    ("bodies", "bodies", "no effect names one"),
    ("topics", "topics read", "none for effects"),
)
"""Key of a plan's summary, its title, and what is said where it is empty."""
ALL_PAIRS = "all with relative motion, because the scene declares neither effects nor pairs"


def plan_lines(name: str, plan_fields: Mapping[str, Any]) -> Iterator[str]:
    """A plan's summary: below its heading every item stands with the reason why it is needed."""
    yield name or "scene"
    for key, title, nothing_text in PLAN_SECTIONS:
        reasons_of_item = plan_fields[key]
        yield (
            f"  {title} ({len(reasons_of_item)})"
            if reasons_of_item
            else f"  {title}: {ALL_PAIRS if reasons_of_item is None else nothing_text}"
        )
        yield from (f"    {item}: because {_reason(why)}" for item, why in (reasons_of_item or {}).items())
    if plan_fields["not_run"]:
        yield f"  not run: {', '.join(plan_fields['not_run'])}"


def _reason(reasons: list[str]) -> str:
    """``contact needs it, and grasp``: sentences as they are, effects as those that need the item."""
    effects, sentences = (
        [reason for reason in reasons if " " not in reason],
        [reason for reason in reasons if " " in reason],
    )
    if effects:
        sentences.append(f"{' and '.join(effects)} {'needs' if len(effects) == 1 else 'need'} it")
    return ", ".join(sentences)
