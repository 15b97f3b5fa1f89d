"""Names of bodies that a scene calls the same: different, and as short as that allows."""

from hypothesis import given
from hypothesis import strategies as st

from sessions.scene_formats.body_names import distinct_names, repeated_names

STEP = st.sampled_from(["a", "b", "b-2", "cup"])
"""A step of the path of a body in its scene."""


@given(st.lists(st.lists(STEP, min_size=1, max_size=4), max_size=12))
def test_names_differ_and_end_in_their_bodies_own(paths):
    """A body is called by the last step of its path (own name), with a number behind it, or with steps before it.

    ``repeated_names`` returns a sentence where any body got another name than its own.
    """
    own_names, names = [path[-1] for path in paths], distinct_names(paths)
    assert len({*names}) == len(paths)
    for name, own_name in zip(names, own_names, strict=True):
        assert name.rpartition("/")[2].startswith(own_name), name
    assert bool(repeated_names(own_names, names)) == (names != own_names)


def test_duplicate_body_names_get_numbers_not_yet_taken():
    """Two bodies are called cup, and a third cup-2: so the second cup gets the number 3."""
    assert distinct_names([["cup"], ["cup"], ["cup-2"]]) == ["cup", "cup-3", "cup-2"]


def test_long_list_of_names_is_cut():
    """Six of seven cups were renamed; the sentence lists five and counts the sixth."""
    own_names = ["cup"] * 7
    names = ["cup", "cup-2", "cup-3", "cup-4", "cup-5", "cup-6", "cup-7"]
    (sentence,) = repeated_names(own_names, names)
    assert "cup-6" in sentence and "cup-7" not in sentence
    assert sentence.endswith("and 1 more")
