"""Lines above a table and missing numbers in its first rows change nothing: the poses are those that were written."""

import numpy as np

from sessions.importers import import_session
from sessions.importers.csv_draft import UnknownColumnsError
from sessions.importers.ledger import POSES, ledger_of
from sessions.importers.recognition import recognised_format

HEAD = "time,cup_x,cup_y,cup_z,cup_qx,cup_qy,cup_qz,cup_qw"
ROWS = [f"{row / 90:.6f},{row / 8},1.5,-2.25,0.0,0.0,0.0,1.0" for row in range(12)]
BEGINNINGS = {
    "nothing": "",
    "a comment": "# subject 3\n",
    "a comment with commas": "# subject 3, trial 2, morning\n",
    "several comments": "# subject 3\n#\n# a sunny morning\n",
    "a comment of another language": "% subject 3, trial 2\n",
    "a comment of a program": "// subject 3, trial 2\n",
    "empty lines": "\n\n",
    "a byte order mark": "\ufeff",
    "a mark and a comment": "\ufeff# subject 3, trial 2\n",
    "Excel's line": "sep=,\n",
    "a mark and Excel's line": "\ufeffsep=,\r\n",
    "Excel's line and a comment": "sep=,\n# subject 3\n",
    "an empty line and a comment": "\n# subject 3, trial 2\n\n",
}
MISSING = ("inf", "-inf", "+Inf", "Infinity", "-Infinity", "nan", "NaN", "-nan", "1.#INF", "∞")


def imported(kind, path):
    """The session of a CSV by its own draft, in axes that change nothing."""
    try:
        return import_session(kind, path, convention="canonical")
    except UnknownColumnsError as error:
        mapping = path.with_suffix(".toml")
        mapping.write_text(error.draft_with_axes("canonical"), "utf-8")
        return import_session("csv", path, mapping=mapping)


def test_harmless_lines_above_a_table_are_passed_over(tmp_path):
    """Comments, empty lines, a byte order mark or Excel's "sep=," (BEGINNINGS) stand above a header and 12 rows.

    All 12 are read, their x from 0 on by 1/8 m a row. The file is recognised as CSV, which the import "auto" goes by.
    """
    for name, beginning in BEGINNINGS.items():
        path = tmp_path / f"{name}.csv"
        path.write_text("\n".join([beginning + HEAD, *ROWS, ""]), "utf-8", newline="")
        recognised, _reason = recognised_format(path)
        assert recognised == "csv", name
        track = imported("csv", path).tracks["cup"]
        assert track.positions[:, 0].tolist() == [row / 8 for row in range(12)], name


def test_auto_knows_numbers_between_spaces_below_a_comment(tmp_path):
    """A trajectory as TUM writes it, a stamp, a position and a quaternion a row; a comment names the columns.

    All 12 rows are poses of a body that is called like the file, take.txt.
    """
    lines = ["# ground truth", "# timestamp tx ty tz qx qy qz qw", *(row.replace(",", " ") for row in ROWS)]
    (tmp_path / "take.txt").write_text("\n".join([*lines, ""]))
    assert len(imported("auto", tmp_path / "take.txt").tracks["take"]) == 12


def test_missing_numbers_in_first_rows_are_lost_poses(tmp_path):
    """The first two of 12 rows have no number in a column of the pose but a word of MISSING: two poses are lost.

    Each word stands in another column than the word before.
    """
    for number, word in enumerate(MISSING):
        rows = [row.split(",") for row in ROWS]
        for row in rows[:2]:
            row[1 + number % 7] = word
        path = tmp_path / "take.csv"
        path.write_text("\n".join([HEAD, *map(",".join, rows), ""]), "utf-8")
        session = imported("csv", path)
        assert session.tracks["cup"].valid.tolist() == [False] * 2 + [True] * 10, word
        (account,) = (entry for entry in ledger_of(session.facts) if entry.kind == POSES)
        assert (account.read, account.kept, account.dropped) == (12, 10, {"with a missing number": 2}), word


def test_dates_beside_empty_cells_are_no_header(tmp_path):
    """The body is first seen in the third row of 12; beside the dates of the first two all cells are empty.

    They are two rows without a pose, and no lines of a header.
    """
    dates = [f"2024-05-01T12:00:00.{row:02d}0Z" for row in range(12)]
    cells = [",,,,,," if row < 2 else text.partition(",")[2] for row, text in enumerate(ROWS)]
    lines = [HEAD, *(f"{date},{text}" for date, text in zip(dates, cells, strict=True)), ""]
    (tmp_path / "take.csv").write_text("\n".join(lines))
    session = imported("csv", tmp_path / "take.csv")
    assert np.flatnonzero(session.tracks["cup"].valid).tolist() == [*range(2, 12)]
