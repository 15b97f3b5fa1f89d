import pytest
from support.small_worlds import cubes


@pytest.fixture(scope="package")
def bumped():
    """Two cubes that touch in three of twelve frames, and whose balls overlap in five more."""
    return cubes({"a": [0] * 12, "b": [3, 1.3, 1.3, 3, 0.9, 3, 1.3, 1.3, 0.9, 0.8, 1.3, 3]})
