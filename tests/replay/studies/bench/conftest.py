"""Timing collects garbage first: what earlier tests left is set apart, so that a collection looks at a test's own."""

import gc

import pytest


@pytest.fixture(autouse=True, scope="module")
def nothing_of_earlier_tests_is_looked_through():
    gc.collect()
    gc.freeze()
