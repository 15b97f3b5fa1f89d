"""Tests of this folder begin when the common kernels are compiled, and cut each mesh once a worker."""

import pytest

from replay.advice import collider_search


@pytest.fixture(autouse=True, scope="session")
def wait_for_kernels(common_kernels):
    """Waits once a worker."""


@pytest.fixture(autouse=True, scope="session")
def shared_pieces(tmp_path_factory):
    """Keeps convex pieces for all tests of a worker; the user's own cache is neither read nor written."""
    folder = tmp_path_factory.mktemp("pieces")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("replay.cutting.piece_store.cache_folder", lambda: folder)
        yield


@pytest.fixture(scope="module")
def quickest_cutter_only():
    """Bodies are cut by the quickest method alone: others, and joins by the motion, take seconds for each body.

    Yields the join by the motion, for tests of it.
    """
    join_by_motion = collider_search.ColliderSearch._join_by_motion
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(collider_search, "OTHER_METHODS", ())
        patch.setattr(collider_search.ColliderSearch, "_join_by_motion", lambda *_: None)
        yield join_by_motion
