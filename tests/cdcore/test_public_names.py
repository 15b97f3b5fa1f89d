"""The package gives every public name on first use and names them all when asked for one it does not have."""

from __future__ import annotations

from importlib import import_module

import pytest

import cdcore


@pytest.mark.parametrize("name", cdcore.__all__)
def test_every_public_name_is_the_one_of_its_home(name):
    assert getattr(cdcore, name) is getattr(import_module(cdcore._HOME[name]), name)


def test_every_name_with_a_home_is_public_and_sorted_into_the_list():
    assert set(cdcore.__all__) == set(cdcore._HOME) == set(dir(cdcore))


def test_a_name_that_is_not_there_is_answered_with_those_that_are():
    with pytest.raises(AttributeError, match=r"no attribute 'Mesh'; it has: .*TriangleMesh"):
        _ = cdcore.Mesh
