"""``replay view``: the pictures of runs, or of sessions as they were recorded, in a viewer of their own."""

from pathlib import Path

import click

from replay.cli.console import People
from replay.cli.options import FILE_OR_FOLDER, common
from sessions.temporary_folders import temporary_folder


@click.command()
@click.argument("runs", type=FILE_OR_FOLDER, metavar="RUN|SESSION.mcap...", nargs=-1, required=True)
@click.option(
    "--miss",
    type=click.IntRange(min=1),
    metavar="N",
    help="Open at this missed, late or short contact; else at the worst moment.",
)
@click.option("--false", type=click.IntRange(min=1), metavar="N", help="Open at this false contact.")
@click.option("--by", default="", metavar="LABEL", help="Detector of that fault. Default: the first that has it.")
@common
def command(runs: tuple[Path, ...], miss: int | None, false: int | None, by: str, people: People) -> int:
    """Open the pictures of run folders in one viewer, on this machine only, or a session as it was recorded.

    The first of several runs is shown, and the cursor of each stands at the same second; Ctrl+Alt+Down shows the next.
    The options name a moment of the first run.

    \b
    replay view run1
    replay view session.mcap
    replay view run1 --miss 4
    replay view run1 --false 2 --by hull50
    replay view runs/before runs/after
    """
    import replay

    moment_text = f" at miss {miss}" if miss else f" at false contact {false}" if false else ""
    with temporary_folder() as folder:
        recordings = [run if run.is_dir() else _write_picture(run, folder, people) for run in runs]
        people.say(
            f"opening {' and '.join(map(str, runs))}{moment_text}; close its window, or press Ctrl-C here, to end"
        )
        if len(runs) > 1:
            people.say("Ctrl+Alt+Down in the viewer shows the next run")
        replay.view(*recordings, miss=miss, false=false, by=by)
    return 0


def _write_picture(session: Path, folder: Path, people: People) -> Path:
    """A run folder with the picture of a session in which no detector was asked."""
    import replay

    people.say(f"drawing {session} as it was recorded ...")
    out = folder / session.stem
    replay.run(session, detectors=(), out=out)
    return out
