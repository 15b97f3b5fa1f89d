"""Names of bodies that a scene calls the same: different, and as short as that allows."""

from hypothesis import given
from hypothesis import strategies as st

from sessions.scene_formats.body_names import distinct_names, repeated_names

STEP = st.sampled_from(["a", "b", "b-2", "cup"])


@given(st.lists(st.lists(STEP, min_size=1, max_size=4), max_size=12))
def test_names_differ_and_end_as_their_bodies(paths):
    names = distinct_names(paths)
    assert len({*names}) == len(paths)
    assert all(name.rpartition("/")[2].startswith(path[-1]) for name, path in zip(names, paths, strict=True))
    assert bool(repeated_names([path[-1] for path in paths], names)) == any(
        name != path[-1] for name, path in zip(names, paths, strict=True)
    )


def test_duplicate_body_names_get_numbers_not_yet_taken():
    assert distinct_names([["cup"], ["cup"], ["cup-2"]]) == ["cup", "cup-3", "cup-2"]


def test_long_list_of_names_is_cut():
    assert repeated_names(["cup"] * 7, ["cup", *(f"cup-{k}" for k in range(2, 8))])[0].endswith("and 1 more")
