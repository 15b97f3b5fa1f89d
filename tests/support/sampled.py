"""Which tests run a part of their cases among the quick tests."""

import tomllib
from pathlib import Path

SAMPLED = tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8"))
"""Tests of many like cases: one case in so many is quick, the others run with the slow tests."""
