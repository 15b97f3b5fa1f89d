"""Kernels that run as plain Python, for a debugger or coverage, give what machine code gives."""

import json

import pytest
from support.digests import answers, interpreted_answers


def assert_same(first, last):
    compiled = json.loads(json.dumps(answers(first, last)))
    interpreted = interpreted_answers(first, last)
    assert {name: rows for name, rows in interpreted.items() if rows != compiled[name]} == {}


def test_interpreted_kernels_give_digests_of_compiled_kernels():
    assert_same(0, 1)


@pytest.mark.slow
def test_interpreted_kernels_agree_on_more_random_worlds():
    assert_same(1, 5)
