"""Tests of this folder begin when the common kernels are compiled."""

import pytest


@pytest.fixture(autouse=True, scope="session")
def wait_for_kernels(common_kernels):
    """Waits once a worker."""


@pytest.fixture(scope="module")
def quickest_cutter_only():
    """Bodies are cut by the quickest method alone: V-HACD and CoACD take seconds for each number of pieces."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("replay.advice.collider_search.OTHER_METHODS", ())
        yield
