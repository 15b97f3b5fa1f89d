"""``replay mesh``: a mesh mended, step by step."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from replay.cli.console import EXIT_OK, People, answer
from replay.cli.options import ANY_PATH, SESSION_FILE, force, reporting, require_free

if TYPE_CHECKING:
    from sessions.mesh_data import MeshData


@click.group()
def command() -> None:
    """Mend a mesh."""


@command.command()
@click.argument("source", type=SESSION_FILE, metavar="MESH|FILE.mcap")
@click.option("--out", "-o", type=ANY_PATH, required=True, metavar="FILE.glb", help="Mesh file to write.")
@click.option("--body", metavar="NAME", help="The body whose mesh is mended; needed for a recording.")
@force
@reporting
def repair(source: Path, out: Path, body: str | None, force: bool, as_json: bool, people: People) -> int:
    """Join split vertices, remove flat and repeated faces, close holes, turn faces outwards; say what is left wrong.

    \b
    replay mesh repair cup.obj -o cup.glb
    replay mesh repair session.mcap --body beaker -o beaker.glb
    """
    from replay.errors import OutputError
    from sessions.doctor.meshes import mesh_findings, repaired_mesh
    from sessions.meshes.glb import mesh_to_glb
    from sessions.whole_files import whole_file

    if source.suffix.lower() == ".mcap" and body is None:
        raise click.UsageError("say whose mesh it is in the recording with --body NAME")
    require_free(out, overwrite=force)
    repaired, repair_steps = repaired_mesh(_mesh(source, body))
    remaining_messages = [finding.message for finding in mesh_findings(out.stem, repaired)]
    with whole_file(out, OutputError, overwrite=force, parents=True) as file:
        file.write(mesh_to_glb(repaired, body or out.stem))
    people.say(*(repair_steps or ["nothing to mend"]), *(f"left: {text}" for text in remaining_messages))
    answer(as_json, {"out": str(out), "done": repair_steps, "left": remaining_messages}, lambda: str(out))
    return EXIT_OK


def _mesh(source: Path, body: str | None) -> "MeshData":
    from replay.errors import AssemblyError
    from sessions import read_session
    from sessions.meshes.mesh_files import load_mesh

    if source.suffix.lower() != ".mcap" or body is None:
        return load_mesh(source)
    meshes = read_session(source).meshes
    if body not in meshes:
        raise AssemblyError(f"{source} holds no mesh of {body!r}; there are: {', '.join(meshes) or 'none'}")
    return meshes[body]
