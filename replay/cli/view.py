"""``replay view``: the picture of a run in a viewer of its own."""

from pathlib import Path

import click

from replay.cli.console import People
from replay.cli.options import RUN_FOLDER, common


@click.command()
@click.argument("run", type=RUN_FOLDER, metavar="RUN")
@click.option("--miss", type=click.IntRange(min=1), metavar="N", help="Open at this miss; else at the longest cut.")
@common
def command(run: Path, miss: int | None, people: People) -> int:
    """Open the picture of the run folder RUN in a viewer of its own, on this machine only.

    \b
    replay view run1
    replay view run1 --miss 4
    """
    from replay.outputs.results.run_folder import read_run_folder

    folder = read_run_folder(run)
    folder.require_miss(miss)
    people.say(f"opening {folder.picture}" + (f" at miss {miss}" if miss else "") + " ...")
    from replay.outputs.rerun_log.viewer import open_viewer

    with open_viewer(run, miss) as viewer:
        people.say("close its window, or press Ctrl-C here, to end")
        viewer.process.wait()
    return 0
