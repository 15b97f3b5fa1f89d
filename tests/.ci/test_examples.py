"""Examples of properties come from a fixed seed where a release is decided; the weekly run alone draws new ones."""

from pathlib import Path

import pytest
from hypothesis import settings

SCRIPTS = Path(__file__).resolve().parents[2] / ".ci"


def test_properties_draw_their_examples_from_a_fixed_seed(pytestconfig):
    """Hypothesis takes its seed from the test itself (``derandomize``), unless the command line asks for a profile."""
    if pytestconfig.getoption("--hypothesis-profile"):
        pytest.skip("a profile was requested")
    assert settings.default.derandomize


def test_only_the_weekly_run_draws_new_examples():
    """Only "newest" asks for it, of the scripts without an ending, some of which decide about a release."""
    scripts = [path for path in SCRIPTS.iterdir() if path.is_file() and not path.suffix]
    assert {"run", "lowest", "slow", "newest"} <= {path.name for path in scripts}
    drawing_new = [path.name for path in scripts if "--hypothesis-profile fresh" in path.read_text("utf-8")]
    assert drawing_new == ["newest"]
