"""The rows of the table of detectors as parameters of a test; a row whose engine is not installed is skipped."""

from importlib.util import find_spec

import pytest

from cdcore.detectors import DETECTORS, OPTIONAL

ROWS = list(DETECTORS) + [
    pytest.param(name, marks=pytest.mark.skipif(find_spec(name) is None, reason=f"{name} is no part of `test`"))
    for name in OPTIONAL
]
