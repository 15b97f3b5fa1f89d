"""``replay view``: the picture of a run in a viewer of its own."""

from pathlib import Path

import click

from replay.cli.console import People
from replay.cli.options import RUN_FOLDER, common


@click.command()
@click.argument("run", type=RUN_FOLDER, metavar="RUN")
@click.option("--miss", type=click.IntRange(min=1), metavar="N", help="Open at this miss; else at the worst moment.")
@click.option("--false", type=click.IntRange(min=1), metavar="N", help="Open at this false contact.")
@click.option("--by", default="", metavar="LABEL", help="Of which detector; else of the first that has it.")
@common
def command(run: Path, miss: int | None, false: int | None, by: str, people: People) -> int:
    """Open the picture of the run folder RUN in a viewer of its own, on this machine only.

    \b
    replay view run1
    replay view run1 --miss 4
    replay view run1 --false 2 --by hull50
    """
    watch(run, people, miss, false, by)
    return 0


def watch(run: Path, people: People, miss: int | None = None, false: int | None = None, by: str = "") -> None:
    """Open the picture of a run folder and wait until its window is closed."""
    from replay.outputs.results.run_folder import PICTURE, SUMMARY, read_run_folder

    # The folder of a diff has a picture and no summary.
    if (run / SUMMARY).is_file() or not (run / PICTURE).is_file():
        read_run_folder(run).require_miss(miss)
    where = f" at miss {miss}" if miss else f" at false contact {false}" if false else ""
    people.say(f"opening {run / PICTURE}{where} ...")
    from replay.outputs.rerun_log.viewer import open_viewer

    with open_viewer(run, miss, false=false, by=by) as viewer:
        people.say("close its window, or press Ctrl-C here, to end")
        viewer.process.wait()
