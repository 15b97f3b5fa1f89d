"""Errors that count what they list."""

from pathlib import Path

import pytest

from replay.errors import MOST_PROBLEMS, RunFolderError


@pytest.mark.parametrize(
    ("count", "words", "rest"),
    [
        (1, "has 1 value that no run writes", ""),
        (MOST_PROBLEMS, f"has {MOST_PROBLEMS} values that no run writes", ""),
        (MOST_PROBLEMS + 2, f"has {MOST_PROBLEMS + 2} values that no run writes", "; and 2 more"),
    ],
)
def test_error_of_a_run_folder_counts_and_lists_problems(count, words, rest):
    """``count``: of values that no run writes; the first MOST_PROBLEMS are listed, all are kept in the error."""
    problems = [f"answer.{row}" for row in range(count)]
    error = RunFolderError.of_problems(Path("run.json"), problems)
    assert str(error).startswith(
        f"run.json {words}: {'; '.join(problems[:MOST_PROBLEMS])}{rest}. Run its session again"
    )
    assert error.problems == tuple(problems)


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (PermissionError(13, "Permission denied"), "cannot be opened (Permission denied)"),
        (OSError("no footer"), "is damaged"),
        (ValueError("no footer"), "is damaged"),
    ],
)
def test_unreadable_file_is_damaged_unless_the_system_refuses_it(error, reason):
    """An error of the system has a reason of its own; a library that cannot read a file has none."""
    assert str(RunFolderError.unreadable(Path("run.json"), error)).startswith(f"run.json {reason}; ")
