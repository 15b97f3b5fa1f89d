"""``replay shrink``: a wrong answer, cut down to a test."""

from pathlib import Path
from typing import Any

import click

from replay.cli.console import People, TerminalProgress, answer
from replay.cli.options import ANY_PATH, RUN_FOLDER, SESSION_FILE, force, import_from_current_folder, reporting, scene

DETECTOR_HELP = "Detector: a label of the run; of code of your own label=module:Class."


@click.command()
@click.argument("run", type=RUN_FOLDER, metavar="RUN")
@click.option("--miss", type=click.IntRange(min=1), metavar="N", help="This missed, late or short contact.")
@click.option("--false", type=click.IntRange(min=1), metavar="N", help="This false contact.")
@click.option("--detector", "--by", "label", metavar="NAME", help=DETECTOR_HELP)
@click.option("--session", type=SESSION_FILE, metavar="FILE", help="The recording, if the run does not lead to it.")
@click.option("--out", "-o", type=ANY_PATH, default="case", show_default=True, metavar="DIR", help="Folder to write.")
@scene
@force
@reporting
def command(run: Path, out: Path, force: bool, as_json: bool, people: People, **options: Any) -> int:
    """Cut a wrong answer down to the fewest frames and faces that still give it, and write it as a test.

    The detector runs again and again on less, with its settings, its sampling offset and its memory. The
    folder holds test_case.py for pytest, the meshes as OBJ, the poses as CSV and a README for a bug report.

    \b
    replay shrink RUN --miss 4 --out case
    replay shrink RUN --false 1 --detector hull50
    replay shrink RUN --miss 2 --detector mine=my_lab:Detector
    """
    miss, false = options["miss"], options["false"]
    if (miss is None) == (false is None):
        raise click.UsageError("name a wrong answer of the run with --miss N or --false N")
    from replay.show.results.run_folder import check_target, read_run_folder
    from replay.studies.shrink.reduce import Shrinking, Size
    from replay.studies.shrink.writing import CASE_FOLDER, sentence, write_case
    from replay.studies.shrink.wrong_answer import fault_of_run

    check_target(out, force=force, kind=CASE_FOLDER)
    import_from_current_folder([options["label"] or ""])
    fault = fault_of_run(read_run_folder(run), **options)
    source = f"miss {miss}" if miss is not None else f"false contact {false}"
    size_before, shrinking = Size.of(fault), Shrinking(fault, TerminalProgress(people))
    smallest_fault = shrinking.run()
    write_case(smallest_fault, size_before, out, source=source, force=force)
    json_value = {
        "before": str(size_before),
        "after": str(Size.of(smallest_fault)),
        "questions": shrinking.questions,
        "out": str(out),
        "doubts": sorted(shrinking.doubts),
    }
    answer(
        as_json,
        json_value,
        lambda: [
            sentence(smallest_fault),
            *(f" {doubt}" for doubt in sorted(shrinking.doubts)),
            f" {size_before} became {Size.of(smallest_fault)} in {shrinking.questions} questions",
            f" wrote {out}; its test fails until the answer is right: python -m pytest {out / 'test_case.py'}",
        ],
    )
    return 0
