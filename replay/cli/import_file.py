"""``replay import``: a recording of another program as a session file."""

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Any

import click

from replay.cli.console import EXIT_DATA_LOSS, EXIT_OK, People, answer
from replay.cli.options import ANY_PATH, FILE_OR_FOLDER, SESSION_FILE, Number, force, reporting, require_free
from replay.cli.options import meshes as meshes_option
from replay.words import plural

if TYPE_CHECKING:
    from sessions import Session
    from sessions.importers.csv_draft import UnknownColumnsError

AXES_HELP = "Axes of mesh files: body, x-flipped, y-up, gltf, unity, ... Repeatable."
SURFACE_WORDS = "mjcf, usd: geometry that is a body's surface.  [default: auto]"
ROTATIONS_HELP = "How the source writes rotations: as poses are (body-to-world), or inverted."
UNIT_HELP = "Unit of mesh files: m, cm, mm, inch, ft. Default: by the file, or its size. Repeatable."
OFFSET_HELP = "contacts: what to add to their clock. Default: estimated."


@click.command()
@click.argument("kind", metavar="FORMAT")
@click.argument("source", type=FILE_OR_FOLDER, metavar="SOURCE", required=False)
@click.option("--out", "-o", type=ANY_PATH, required=True, metavar="FILE.mcap", help="Session file to write.")
@force
@click.option("--mesh", "named", multiple=True, metavar="BODY=FILE", help="Mesh of a body: left=wand.glb. Repeatable.")
@meshes_option
@click.option("--mesh-units", multiple=True, metavar="[BODY=]UNIT", help=UNIT_HELP)
@click.option("--colliders", type=SESSION_FILE, metavar="FILE.glb", help="Colliders of the engine, a node each.")
@click.option("--scene", type=SESSION_FILE, metavar="SCENE.toml", help="Bodies, pairs, effects.")
@click.option("--mapping", type=SESSION_FILE, metavar="FILE", help="csv, xdf: which column or channel is what.")
@click.option("--convention", metavar="NAME", help="Axes of the source: unity, unreal, ... or 'z up, left-handed'.")
@click.option("--rotations", type=click.Choice(["body-to-world", "world-to-body"]), help=ROTATIONS_HELP)
@click.option("--motion", type=SESSION_FILE, metavar="FILE.npz", help="mjcf: joint angles over time, .npz or .csv.")
@click.option("--root", type=FILE_OR_FOLDER, metavar="DIR", help="mjcf, usd: the folder that holds all files.")
@click.option("--surface", type=click.Choice(["auto", "drawn", "colliding"]), help=SURFACE_WORDS)
@click.option("--topic", "topics", multiple=True, metavar="TOPIC", help="mcap, ros2: read this alone. Repeatable.")
@click.option("--mesh-axes", multiple=True, metavar="[BODY=]NAME", help=AXES_HELP)
@click.option("--collider-axes", metavar="NAME", help="Axes of the colliders' file. Default: the recording's.")
@click.option("--no-look", is_flag=True, help="Do not try what was guessed: no pictures, no question.")
@click.option("--session", type=SESSION_FILE, metavar="FILE.mcap", help="contacts: the session they belong to.")
@click.option("--offset", type=Number(), metavar="SECONDS", help=OFFSET_HELP)
@reporting
def command(
    kind: str,
    source: Path | None,
    out: Path,
    force: bool,
    session: Path | None,
    offset: float | None,
    as_json: bool,
    people: People,
    no_look: bool,
    **given: Any,
) -> int:
    """Read SOURCE, a recording of another program in FORMAT, and write it as a session file.

    It exits with 3 where more than 1 % of the rows or poses of a body were dropped.

    \b
    replay import aframe motion.json -o session.mcap --mesh left=wand.glb --mesh right=wand.glb
    replay import csv unity.csv -o session.mcap --convention unity
    replay import auto S001 -o session.mcap
    replay import contacts engine.csv --session session.mcap -o with_contacts.mcap
    """
    from sessions import write_session

    if source is None:
        example_source = quote(kind) if Path(kind).exists() else "take.csv"
        raise click.UsageError(
            f"a format, or auto, and a recording are needed: replay import auto {example_source} -o {out}"
        )
    require_free(out, overwrite=force)
    if kind == "contacts":
        imported, notes = _session_with_contacts(source, session, given["scene"], offset)
    else:
        imported = _import_recording(kind, source, out, **given)
        notes = [*_import_notes(imported)]
    if imported.live_contacts:
        if kind != "contacts":
            notes.append(f"{plural(len(imported.live_contacts), 'report')} of the engine, on the recording's own clock")
        notes.append(
            f"it holds the contacts that the engine reported; compare them: replay run {out} --out runs/{out.stem}"
        )
    out.parent.mkdir(parents=True, exist_ok=True)
    write_session(imported, out, overwrite=force)
    people.say(*notes)
    json_value = {"out": str(out), "frames": len(imported.frames), "bodies": list(imported.names), "notes": notes}
    answer(as_json, json_value, lambda: str(out))
    code = EXIT_DATA_LOSS if _large_losses(imported, people) else EXIT_OK
    if kind == "contacts":
        return code
    mapping = given["mapping"]
    return max(code, _open_guesses(imported, out, people, no_look=no_look, as_json=as_json, mapping=mapping))


def _open_guesses(
    imported: "Session", out: Path, people: People, *, no_look: bool, as_json: bool, mapping: Path | None
) -> int:
    """On a terminal, pictures of the scene and questions on what was guessed; in a pipe, an exit code for open ones."""
    from sessions.scene_files.answers import recording_assumptions

    open_titles = [row.title for row in recording_assumptions(imported) if row.is_open]
    is_terminal = sys.stdin.isatty() and sys.stdout.isatty() and not as_json
    if no_look:
        if open_titles:
            people.say(f"not sure: {', '.join(open_titles)}; to see what each would change: replay doctor {out} --look")
    elif is_terminal:
        _show_scene(out, people, mapping)
    elif open_titles:
        from replay.cli.look import decide_in_pipe

        return decide_in_pipe(imported, out, people)
    return EXIT_OK


def _show_scene(out: Path, people: People, mapping: Path | None) -> None:
    from cdcore.errors import CollisionCoreError
    from replay.cli.look import look_at
    from replay.errors import ReplayError
    from sessions.errors import SessionError

    try:
        look_at(out, people, as_json=False, given={}, mapping=mapping)
    except (ReplayError, CollisionCoreError, SessionError) as error:
        people.say(f"No pictures of the scene: {error}")


def _large_losses(imported: "Session", people: People) -> bool:
    """Whether the import dropped more than goes without a warning; then people are told."""
    from sessions.importers.ledger import ledger_of

    ledger = ledger_of(imported.facts)
    losses = ledger.large_losses() if ledger is not None else []
    if losses:
        people.say("Warning: more than 1 % was dropped (exit code 3); every run of this session says so")
    return bool(losses)


def _import_recording(
    kind: str,
    source: Path,
    out: Path,
    *,
    named: tuple[str, ...],
    meshes: Path | None,
    scene: Path | None,
    **options: Any,
) -> "Session":
    """The recording with the meshes, the colliders and the scene given, and with what was assumed of all of them."""
    from sessions.importers import import_session, makes_bodies
    from sessions.importers.csv_draft import UnknownColumnsError

    import_options = {name: value for name, value in options.items() if value}
    import_options["meshes"] = _mesh_files(named)
    if meshes is not None:
        import_options["mesh_folder"] = meshes
    joins_scene = scene is not None and (_adds_to_recording(scene) or makes_bodies(kind, source))
    if scene is not None and not joins_scene:
        from sessions.scene_files.scene_toml import read_scene

        import_options |= {"scene": read_scene(scene), "scene_folder": scene.parent}
    further_options = [f"--mesh {quote(text)}" for text in named]
    if meshes is not None:
        further_options.append(f"--meshes {quote(str(meshes))}")
    further_options += [
        f"--{name} {quote(import_options[name])}" for name in ("convention", "rotations") if name in import_options
    ]
    convention = import_options.get("convention", "")
    with _drafting_a_mapping(source, out, further_options, convention):
        try:
            imported = import_session(kind, source, **import_options)
        except UnknownColumnsError as error:
            mapping = _draft_with_axes(error, source, convention)
            if mapping is None:
                raise
            imported = import_session(error.format, source, **import_options, mapping=mapping)
    if scene is None or not joins_scene:
        return imported
    from sessions.scene_files.scene_meshes import with_scene

    return with_scene(imported, scene)


def _draft_with_axes(error: "UnknownColumnsError", source: Path, convention: str) -> Path | None:
    """The file of a drafted mapping that the axes complete; ``None``: it lacks more, or somebody's own is there."""
    from sessions.errors import ImportFileError
    from sessions.whole_files import whole_file

    draft_file, draft_text = _draft_file(source), error.draft_with_axes(convention) if convention else ""
    if not draft_text or (
        draft_file.exists() and draft_file.read_bytes() not in (draft_text.encode(), error.draft.encode())
    ):
        return None
    with whole_file(draft_file, ImportFileError) as stream:
        stream.write(draft_text.encode())
    return draft_file


def _draft_file(source: Path) -> Path:
    return source.with_suffix(".columns.toml")


def _adds_to_recording(scene: Path) -> bool:
    """Whether a scene file declares no body of its own, or takes those of another program: it is joined afterwards."""
    from sessions.errors import SceneError
    from sessions.input_files import read_text
    from sessions.scene_files.scene_toml import declares_bodies, named_source

    text = read_text(scene, "scene", SceneError)
    return not declares_bodies(text, scene.name) or bool(named_source(text, scene.name)["from"])


@contextmanager
def _drafting_a_mapping(
    source: Path, session_file: Path, further_options: Sequence[str], convention: str
) -> Iterator[None]:
    """Beside a CSV that nobody has described a draft of its mapping is written; the error says how to go on.

    ``further_options``: those of the command that go with the mapping. ``convention``: the axes that it names, or
    ``""``.
    """
    from sessions.errors import ImportFileError
    from sessions.importers.csv_draft import UnknownColumnsError
    from sessions.whole_files import whole_file

    try:
        yield
    except UnknownColumnsError as error:
        draft_file = _draft_file(source)
        todo = " ".join(
            [f"replay import {error.format} {source} --mapping {draft_file}", *further_options, f"-o {session_file}"]
        )
        if draft_file.exists() and draft_file.read_bytes() != error.draft.encode():
            raise ImportFileError(f"{error}; {draft_file} is there already: {todo}") from None
        with whole_file(draft_file, ImportFileError) as stream:
            stream.write(error.draft.encode())
        unknown_columns = ", ".join(error.unknown_beside(convention))
        axes = "; or name the axes with --convention" if error.draft_with_axes("unity") and not convention else ""
        raise ImportFileError(
            f"{error}; a draft is in {draft_file}: say there {unknown_columns}{axes}, then: {todo}"
        ) from None


def _session_with_contacts(
    source: Path, session: Path | None, scene: Path | None, offset: float | None
) -> "tuple[Session, list[str]]":
    """A session with the reported contacts in it, and how well their clock fits."""
    if session is None:
        raise click.UsageError("contacts belong to a session; name it with --session FILE.mcap")
    from replay.prepare.assemble import unknown_in_reports
    from replay.running.contact_import import import_contacts
    from sessions import read_session

    joined_session, clock_fit = import_contacts(source, read_session(session, scene=scene), offset=offset)
    return joined_session, [
        f"{plural(len(joined_session.live_contacts), 'report')} of {source}; {clock_fit}",
        *unknown_in_reports(joined_session),
    ]


def _mesh_files(mesh_options: tuple[str, ...]) -> dict[str, Path]:
    """Body -> mesh file."""
    meshes = {}
    for text in mesh_options:
        body, _, file = text.partition("=")
        if not body or not file:
            raise click.BadParameter(f"{text!r} is not BODY=FILE, for example left=wand.glb", param_hint="--mesh")
        if body in meshes:
            raise click.BadParameter(f"{body} is given two meshes; give it one", param_hint="--mesh")
        meshes[body] = SESSION_FILE.convert(file, None, None)
    return meshes


def _names_by_group(session: "Session") -> list[str]:
    """Names of the bodies, those of a group as the group."""
    groups = {group.name: len(group.members) for group in session.scene.groups}
    group_of = session.scene.group_of
    names = dict.fromkeys(group_of.get(name, name) for name in session.names)
    return [f"{name} ({groups[name]} bodies)" if name in groups else name for name in names]


def _import_notes(session: "Session") -> Iterator[str]:
    from sessions.doctor.finding import CODES
    from sessions.importers.ledger import ledger_of
    from sessions.meshes.separate_surfaces import separate_surfaces_text
    from sessions.model.assumption import DRAFTED, Origin, Subject
    from sessions.scene_files.answers import recording_assumptions

    yield f"{plural(len(session.frames), 'frame')} of {', '.join(_names_by_group(session))}"
    if "taken_for" in session.facts:
        yield f"taken for {session.facts['taken_for']}"
    if session.facts.get("conversions", "none") != "none":
        yield f"converted: {session.facts['conversions']}"
    ledger = ledger_of(session.facts)
    if ledger is not None:
        yield from ledger.sentences()
    for name, mesh in session.meshes.items():
        if text := separate_surfaces_text(mesh):
            yield f"mesh of {name}: {text}; {CODES['mesh-apart'].fix}"
    for row in recording_assumptions(session):
        of_mesh = row.subject in (Subject.MESH_AXES, Subject.COLLIDER_AXES) and row.origin is not Origin.FORMAT
        if (
            of_mesh
            or (row.subject is Subject.LENGTH_UNIT and row.is_open)
            or (
                row.subject in (*DRAFTED, Subject.JOINT_RADII, Subject.SURFACE)
                and row.origin is Origin.GUESS
                and not row.is_open
            )
        ):
            yield f"{row.title}: {row.sentence}"
    if "assumed" in session.facts:
        cure_text = "; name other axes with --convention" if "axes" in session.facts["assumed"] else ""
        yield f"assumed: {session.facts['assumed']}{cure_text}"
    proxies = [body.id for body in session.scene.bodies if body.proxy]
    if proxies:
        yield f"proxy meshes stand in for: {', '.join(proxies)}; give the real ones with --mesh"
