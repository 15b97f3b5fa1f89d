"""The folder of a diff: its figures, and one recording in which both runs lie under one cursor."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from replay.errors import RunFolderError
from replay.outputs.results.run_folder import (
    EPISODES,
    PICTURE,
    FolderKind,
    read_run_folder,
    result_folder,
    write_summary,
)
from replay.outputs.tables import markdown
from replay.studies.diff.diff_words import GAINED, LOST, SHIFTED, changes, diff_table, headline, settings_words

if TYPE_CHECKING:
    from replay.studies.diff.runs import RunDiff

SCHEMA: Final = "vrlab-replay/diff/1"
DIFF: Final = FolderKind("diff", "diff.json", SCHEMA, (PICTURE, "diff.json"))

COLUMNS: Final = ("detector", "same", GAINED, LOST, SHIFTED, "missed", "false")
"""Of the table, those for which a third of a screen has room."""


def write_diff(
    found: "RunDiff", runs: tuple[Path, Path], out: Path, plain: Mapping[str, Any], *, force: bool = False
) -> None:
    """Write ``diff.json`` and the picture into the folder ``out``.

    Raises
    ------
    RunFolderError
        A run has no picture, or the two are of other frames: then there is no common cursor.
    OutputError
        The folder exists, or cannot be written.
    """
    from replay.outputs.rerun_log.diff_recording import DiffedDetector, write_diff_recording

    first, second = (read_run_folder(one) for one in runs)
    parts = ("digest", "first_stamp_ns", "frames")
    if len({tuple(one.summary["session"].get(name) for name in parts) for one in (first, second)}) > 1:
        raise RunFolderError(f"{runs[0]} and {runs[1]} hold other frames, which no picture shows; leave out --out")
    rows = [one.rows(EPISODES) for one in (first, second)]
    detectors = [
        DiffedDetector(
            label, changes(one), *([row for row in table if row["detector"] == label] for table in rows)
        )
        for label, one in found.detectors.items()
    ]  # fmt: skip
    # What changed most is what the picture opens on.
    detectors.sort(key=lambda one: -len(one.changes))
    settings = "\n".join(f"- {one}" for one in settings_words(found))
    words = [f"## {headline(found)}", settings, markdown(replace(diff_table(found), notes=()).only(*COLUMNS))]
    pictures = first.picture, second.picture
    with result_folder(out, DIFF, force=force) as folder:
        write_diff_recording(
            folder / PICTURE, pictures, (runs[0].name, runs[1].name), first.summary["session"], detectors,
            "\n\n".join(words),
        )  # fmt: skip
        write_summary(folder, DIFF, {"schema": SCHEMA, "runs": [one.name for one in runs], **plain})
