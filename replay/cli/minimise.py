"""``replay minimise``: a recording with less of a person in it, and what that changes in its contacts."""

from pathlib import Path

import click

from replay.cli.console import OK, People, answer
from replay.cli.options import ANY_PATH, SESSION_FILE, force, reporting, require_free, scene, tau

LIMIT = (
    "limit: motion itself identifies people: from 100 s of head and hands, 94 % of 55,541 users were recognised "
    "(Nair et al., USENIX Security 2023); treat the file as personal data"
)


@click.command()
@click.argument("session", type=SESSION_FILE, metavar="SESSION.mcap")
@click.option("--out", "-o", type=ANY_PATH, required=True, metavar="FILE.mcap", help="Recording to write.")
@click.option("--drop", multiple=True, type=click.Choice(["head", "height"]),
              help="The headset with its gaze; how high all stands. Repeat it.")  # fmt: skip
@click.option("--keep", multiple=True, type=click.Choice(["time", "place"]), help="As recorded. Repeat it.")
@click.option("--allow", multiple=True, metavar="NAME", help="A name, or a word of names, that may stay. Repeat it.")
@scene
@tau
@force
@reporting
def command(
    session: Path, out: Path, drop: tuple[str, ...], keep: tuple[str, ...], allow: tuple[str, ...], scene: Path | None,
    tau: float, force: bool, as_json: bool, people: People,
) -> int:  # fmt: skip
    """Write SESSION.mcap without serials, names, paths and free text, at another time and place.

    All poses are moved and turned about the vertical together, so that what meets still meets. `exact` is asked before
    and after, and each pair-frame that differs is listed. Names made of words of a laboratory stay.

    \b
    replay minimise session.mcap -o small.mcap
    replay minimise session.mcap -o small.mcap --drop head --drop height
    replay minimise session.mcap -o small.mcap --keep place --allow centrifuge
    """
    from replay.errors import AssemblyError
    from replay.studies.minimise.changes import changes
    from replay.studies.minimise.session import minimise
    from sessions import read_session, write_session

    require_free(out, force=force)
    before = read_session(session, scene=scene)
    made = minimise(before, drop=drop, keep=keep, allow=allow)
    write_session(made.session, out, overwrite=force)
    people.say("asking exact about it before and after ...")
    try:
        found = changes(before, read_session(out), made.names, tau)
    except AssemblyError:
        found = None
    said = [
        *(found.sentences() if found else ["contacts by exact: not compared; no pair of bodies can be asked"]),
        LIMIT,
    ]
    plain = {"done": list(made.done), "contacts": found and found.as_json(), "limit": LIMIT}
    answer(as_json, plain, lambda: [*made.done, *said])
    people.say(f"wrote {out}")
    return OK
