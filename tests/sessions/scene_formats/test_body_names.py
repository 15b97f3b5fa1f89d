"""Names of bodies that a scene calls the same: different, and as short as that allows."""

from hypothesis import given
from hypothesis import strategies as st

from sessions.scene_formats.body_names import distinct_names, repeated_names

STEP = st.sampled_from(["a", "b", "b-2", "cup"])


@given(st.lists(st.lists(STEP, min_size=1, max_size=4), max_size=12))
def test_names_differ_and_end_in_their_bodies_own(paths):
    """A body is called by the last step of its path (own name), a number behind it, or steps before it.

    ``repeated_names`` is a sentence about the bodies that have another name than their own.
    """
    own_names, names = [path[-1] for path in paths], distinct_names(paths)
    assert len({*names}) == len(paths)
    assert all(name.rpartition("/")[2].startswith(own) for name, own in zip(names, own_names, strict=True))
    assert bool(repeated_names(own_names, names)) == (names != own_names)


def test_duplicate_body_names_get_numbers_not_yet_taken():
    """The number 2 is taken by a body that is called cup-2."""
    assert distinct_names([["cup"], ["cup"], ["cup-2"]]) == ["cup", "cup-3", "cup-2"]


def test_long_list_of_names_is_cut():
    """Six of seven cups were renamed; five are listed."""
    assert repeated_names(["cup"] * 7, ["cup", *(f"cup-{k}" for k in range(2, 8))])[0].endswith("and 1 more")
