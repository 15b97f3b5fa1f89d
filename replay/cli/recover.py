"""``replay recover``: what can be read of a torn or damaged session file, in a file that is whole."""

from dataclasses import asdict
from pathlib import Path

import click

from replay.cli.console import EXIT_DATA_LOSS, EXIT_OK, People, answer
from replay.cli.options import ANY_PATH, SESSION_FILE, force, reporting


@click.command()
@click.argument("torn", type=SESSION_FILE, metavar="TORN.mcap")
@click.argument("out", type=ANY_PATH, metavar="OUT.mcap")
@force
@reporting
def command(torn: Path, out: Path, force: bool, as_json: bool, people: People) -> int:
    """Save every whole message of every readable chunk of TORN.mcap to OUT.mcap; say what was lost.

    Exits with 3 when anything was lost, with 0 when the file turns out to be whole.

    \b
    replay recover session.mcap.partial session.mcap
    """
    from sessions.mcap.salvage import recover

    people.say(f"reading {torn}")
    recovery = recover(torn, out, overwrite=force)
    json_value = {**asdict(recovery), "out": str(recovery.out), "whole": recovery.whole, "source": str(torn)}
    answer(as_json, json_value, lambda: [*recovery.sentences(), *["nothing was lost"] * recovery.whole])
    people.say(f"wrote {out}", f"Check it:  replay doctor {out}")
    return EXIT_OK if recovery.whole else EXIT_DATA_LOSS
