"""``replay share``: a run as a folder to send to somebody."""

from pathlib import Path

import click

from replay.cli.console import People
from replay.cli.options import ANY_PATH, RUN_FOLDER, common, force


@click.command()
@click.argument("runs", type=RUN_FOLDER, metavar="RUN...", nargs=-1, required=True)
@click.option("--out", "-o", type=ANY_PATH, required=True, metavar="DIR", help="Folder to write.")
@click.option("--anyway", is_flag=True, help="Also what was not recorded with the fact consent=share.")
@force
@common
def command(runs: tuple[Path, ...], out: Path, anyway: bool, force: bool, people: People) -> int:
    """Write a folder that shows runs in any browser, by a double click on its index.html, without a network.

    The page holds the figures of the report, with the live picture beside it; each miss is a link that moves the
    picture. Send the whole folder. Of several runs index.html is a list; they share one viewer.

    \b
    replay share run1 -o for-anna
    replay share runs/* -o class
    """
    from replay.outputs.results.run_folder import check_target, read_run_folder
    from replay.outputs.share.folder import INDEX, SHARED, require_consent, write_shared_folder

    check_target(out, force=force, kind=SHARED)
    folders = [read_run_folder(run) for run in runs]
    if not anyway:
        require_consent(folders)
    if why := write_shared_folder(folders, out, force=force):
        people.say(f"the report alone, without a picture: {why}")
    size = sum(one.stat().st_size for one in out.iterdir()) / 1e6
    people.say(f"wrote {out}, {size:.0f} MB; open {out / INDEX} in a browser, or send the folder")
    return 0
