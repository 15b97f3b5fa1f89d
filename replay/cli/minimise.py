"""``replay minimise``: a recording with less of a person in it."""

from pathlib import Path

import click

from replay.cli.console import EXIT_OK, People, answer
from replay.cli.options import ANY_PATH, SESSION_FILE, force, reporting, require_free

LIMIT_SENTENCE = (
    "limit: motion itself identifies people: from 100 s of head and hands, 94 % of 55,541 users were recognised "
    "(Nair et al., USENIX Security 2023); treat the file as personal data"
)


@click.command()
@click.argument("session", type=SESSION_FILE, metavar="SESSION.mcap")
@click.option("--out", "-o", type=ANY_PATH, required=True, metavar="FILE.mcap", help="Recording to write.")
@force
@reporting
def command(session: Path, out: Path, force: bool, as_json: bool, people: People) -> int:
    """Write SESSION.mcap without names, texts, serials and the time when it was recorded.

    Poses, meshes, scene, and when events, tasks and stages happened stay; tasks and stages get names that are the same
    in every file, so that a class page still groups by them.
    """
    from replay.studies.minimise import minimise
    from replay.words import plural
    from sessions import read_session, write_session

    require_free(out, overwrite=force)
    original = read_session(session)
    minimised = minimise(original)
    write_session(minimised, out, overwrite=force)
    effects, all_effects = len(minimised.scene.effects or ()), len(original.scene.effects or ())
    kept_text = (
        f"kept: poses of {plural(len(minimised.names), 'body', 'bodies')}, "
        f"{plural(len(minimised.meshes), 'mesh', 'meshes')}, "
        f"{plural(len(minimised.events), 'event')}, {plural(len(minimised.intervals), 'interval')} and {effects} of "
        f"{plural(all_effects, 'effect')} of the scene, under new names, from 2000-01-01 00:00 UTC on"
    )
    answer(as_json, {"kept": kept_text, "limit": LIMIT_SENTENCE}, lambda: [kept_text, LIMIT_SENTENCE])
    people.say(f"wrote {out}")
    return EXIT_OK
