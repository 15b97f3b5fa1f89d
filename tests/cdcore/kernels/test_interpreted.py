"""Kernels that run as plain Python, for a debugger or coverage, give what machine code gives."""

import json

import pytest
from support.digests import answers, interpreted_answers
from support.random_worlds import SHAPES


def assert_same(seeds, shapes, names=()):
    compiled = json.loads(json.dumps(answers(seeds, shapes, names)))
    interpreted = interpreted_answers(seeds, shapes, names)
    assert {name: rows for name, rows in interpreted.items() if rows != compiled[name]} == {}


def test_interpreted_kernels_give_digests_of_compiled_kernels():
    assert_same([0], ["soup"], ["exact"])


@pytest.mark.slow
def test_interpreted_kernels_agree_on_random_worlds():
    """Two worlds of each shape: 46 s of processor time, interpreted."""
    assert_same([0, 2], list(SHAPES))
