"""The rows of the table of detectors as parameters of a test; a row whose engine is not installed is skipped."""

from importlib.util import find_spec

import pytest

from cdcore.detectors import DETECTORS, ENGINE_MODULE

ROWS = list(DETECTORS) + [
    pytest.param(name, marks=pytest.mark.skipif(find_spec(module) is None, reason=f"{module} is no part of `test`"))
    for name, module in ENGINE_MODULE.items()
]
