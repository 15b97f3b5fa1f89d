import pytest

from sessions.errors import SessionFileError
from sessions.mcap.refusals import brief, refusal


@pytest.mark.parametrize(
    ("error", "problem"),
    [
        (refusal("take.mcap", "torn", "it is cut short"), "it is cut short"),
        (SessionFileError("take.mcap: it is cut short"), "it is cut short"),
        (SessionFileError("it is cut short"), "it is cut short"),
    ],
)
def test_brief_states_the_problem_without_file_and_cure(error, problem):
    """A refusal is "file: problem; cure"; an error may lack the cure, or the file too."""
    assert brief(error) == problem


def test_refusal_ends_in_its_own_cure_or_its_codes():
    """The cure is the last argument, or else that of the code "torn"."""
    assert str(refusal("take.mcap", "torn", "it is cut short", "record it again")).endswith("; record it again")
    assert str(refusal("take.mcap", "torn", "it is cut short")).endswith("; save what is there with `replay recover`")
