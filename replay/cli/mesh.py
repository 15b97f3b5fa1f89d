"""``replay mesh``: a mesh mended, step by step, and what that changes in the contacts of a recording."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from replay.cli.console import OK, People, answer
from replay.cli.options import ANY_PATH, SESSION_FILE, force, reporting, require_free

if TYPE_CHECKING:
    from sessions.mesh_data import MeshData


@click.group()
def command() -> None:
    """Mend a mesh, and say what that changes in a recording."""


@command.command()
@click.argument("source", type=SESSION_FILE, metavar="MESH|FILE.mcap")
@click.option("--out", "-o", type=ANY_PATH, required=True, metavar="FILE.glb", help="Mesh file to write.")
@click.option("--body", metavar="NAME", help="Whose mesh: of a recording needed.")
@click.option("--session", type=SESSION_FILE, metavar="FILE.mcap", help="A recording to ask, its BODY with this mesh.")
@force
@reporting
def repair(
    source: Path, out: Path, body: str | None, session: Path | None, force: bool, as_json: bool, people: People
) -> int:  # fmt: skip
    """Join split vertices, remove flat and repeated faces, close holes, turn faces outwards; say what is left wrong.

    With a recording, `exact` is asked before and after, and the pair-frames that change are counted.

    \b
    replay mesh repair cup.obj -o cup.glb
    replay mesh repair session.mcap --body beaker -o beaker.glb
    """
    from replay.errors import OutputError
    from sessions.doctor.meshes import mesh_findings, repaired
    from sessions.meshes.glb import mesh_to_glb
    from sessions.whole_files import whole_file

    recording = source if source.suffix.lower() == ".mcap" else session
    if recording is not None and body is None:
        raise click.UsageError("say whose mesh it is in the recording with --body NAME")
    require_free(out, force=force)
    mesh = _mesh(source, body)
    mended, done = repaired(mesh)
    left = [finding.message for finding in mesh_findings(out.stem, mended)]
    with whole_file(out, OutputError, overwrite=force, parents=True) as file:
        file.write(mesh_to_glb(mended, body or out.stem))
    people.say(*(done or ["nothing to mend"]), *(f"left: {words}" for words in left))
    plain: dict[str, Any] = {"out": str(out), "done": done, "left": left, "contacts": None}
    lines = [str(out)]
    if recording is not None and body is not None:
        people.say(f"asking exact about {recording} with both meshes ...")
        asked, new, gone = _changed(recording, body, mesh, mended)
        plain["contacts"] = {"pair_frames": asked, "new": new, "gone": gone}
        changes = f"{new + gone:,} of {asked:,} pair-frames of {body} change"
        more = f": {new:,} become contact, {gone:,} are none any more"
        lines.append(changes + more * bool(new or gone))
    answer(as_json, plain, lambda: lines)
    return OK


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


def _changed(recording: Path, body: str, before: "MeshData", after: "MeshData") -> tuple[int, int, int]:
    """Pair-frames of a body that `exact` decides both times, those that become contact, those that cease."""
    from dataclasses import replace

    from cdcore.protocol import counts_as_contact, is_undecided
    from replay.api.runner import run
    from sessions import read_session

    held = read_session(recording)
    said = []
    for mesh in (before, after):
        session = replace(held, meshes={**held.meshes, body: mesh})
        result = run(session, detectors="exact", oracle="none", picture=False)
        names = result.assembly.names
        own = [body in (names[i], names[j]) for i, j in result.assembly.pairs.tolist()]
        said.append(result.detections["exact"].verdict[:, own])
    decided = ~is_undecided(said[0]) & ~is_undecided(said[1])
    first, second = (counts_as_contact(verdict) & decided for verdict in said)
    return int(decided.sum()), int((second & ~first).sum()), int((first & ~second).sum())
