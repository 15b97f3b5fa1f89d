"""Tests of this folder begin when the common kernels are compiled."""

import pytest


@pytest.fixture(autouse=True, scope="session")
def wait_for_kernels(common_kernels):
    """Waits once a worker."""
