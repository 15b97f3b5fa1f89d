"""``replay share``: a run as a folder to send to somebody."""

from pathlib import Path

import click

from replay import words
from replay.cli.console import People
from replay.cli.options import ANY_PATH, RUN_FOLDER, common, force


@click.command()
@click.argument("runs", type=RUN_FOLDER, metavar="RUN...", nargs=-1, required=True)
@click.option("--out", "-o", type=ANY_PATH, required=True, metavar="DIR", help="Folder to write.")
@click.option("--anyway", is_flag=True, help="Also share recordings without the fact consent=share.")
@force
@common
def command(runs: tuple[Path, ...], out: Path, anyway: bool, force: bool, people: People) -> int:
    """Write a folder that shows runs in any browser, by a double click on its index.html, without a network.

    The page holds the figures of the report, with the live picture beside it; each miss is a link that moves the
    picture. Send the whole folder. Several runs become a list in index.html, with one viewer.

    \b
    replay share run1 -o for-anna
    replay share runs/* -o class
    """
    from replay.show.share.folder import INDEX_FILE
    from replay.show.viewing import write_shared

    if why := write_shared(runs, out, anyway=anyway, force=force):
        people.say(f"the report alone, without a picture: {why}")
    size = sum(file.stat().st_size for file in out.iterdir()) / 1e6
    people.say(f"wrote {out}, {words.decimal(size, 0)} MB; open {out / INDEX_FILE} in a browser, or send the folder")
    return 0
