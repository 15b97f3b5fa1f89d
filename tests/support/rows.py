"""The rows of the table of detectors as parameters of a test; a row whose engine is not installed is skipped."""

from importlib.util import find_spec

import pytest

from cdcore.detectors import DETECTORS, OPTIONAL

ENGINE_MODULE = {name: row.engine for name, row in OPTIONAL.items()}
"""Row of the table that needs an extra -> the module that it asks."""
ROWS = list(DETECTORS) + [
    pytest.param(name, marks=pytest.mark.skipif(find_spec(module) is None, reason=f"{module} is no part of `test`"))
    for name, module in ENGINE_MODULE.items()
]
