"""Names of the package that are loaded on first use."""

from importlib.metadata import version

import pytest

import replay
from replay.running.runner import run
from replay.studies.diff.runs import diff_runs


def test_public_names_are_those_of_their_modules():
    """``diff`` has another name in its module, ``run`` the same."""
    assert (replay.__version__, replay.diff, replay.run) == (version("vrlab-replay"), diff_runs, run)


def test_unknown_public_name_is_refused_with_those_there_are():
    """The message lists ``tradeoff`` among others."""
    with pytest.raises(AttributeError, match=r"no attribute 'play'; it has: .*tradeoff"):
        getattr(replay, "play")  # noqa: B009
