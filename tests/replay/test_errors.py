"""Errors that count what they list."""

from pathlib import Path

import pytest

from replay.errors import MOST_PROBLEMS, RunFolderError


@pytest.mark.parametrize(
    ("count", "text", "rest"),
    [
        pytest.param(1, "has 1 value that no run writes", "", id="one"),
        pytest.param(MOST_PROBLEMS, f"has {MOST_PROBLEMS} values that no run writes", "", id="as many as are listed"),
        pytest.param(
            MOST_PROBLEMS + 2, f"has {MOST_PROBLEMS + 2} values that no run writes", "; and 2 more", id="two more"
        ),
    ],
)
def test_error_of_a_run_folder_counts_and_lists_problems(count, text, rest):
    """``count``: of values that no run writes. The text lists the first MOST_PROBLEMS, the error itself has all."""
    problems = [f"answer.{row}" for row in range(count)]
    error = RunFolderError.of_problems(Path("run.json"), problems)
    listed = "; ".join(problems[:MOST_PROBLEMS])
    assert str(error).startswith(f"run.json {text}: {listed}{rest}. Run its session again")
    assert error.problems == tuple(problems)


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        pytest.param(PermissionError(13, "Permission denied"), "cannot be opened (Permission denied)", id="system"),
        pytest.param(OSError("no footer"), "is damaged", id="a library's OSError"),
        pytest.param(ValueError("no footer"), "is damaged", id="a library's ValueError"),
    ],
)
def test_unreadable_file_is_damaged_unless_the_system_refuses_it(error, reason):
    """An error of the system has a number and a reason; a library that cannot read a file has none that helps."""
    assert str(RunFolderError.unreadable(Path("run.json"), error)).startswith(f"run.json {reason}; ")
