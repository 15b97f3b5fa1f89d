"""Real recordings and engines that may be absent, with the marks that skip their tests; the product needs neither."""

from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from cdcore.detectors.detector_table import DETECTORS, OPTIONAL

SHARED = Path(__file__).resolve().parents[3] / "shared"
DATA = SHARED / "data"
BENCH = SHARED / "bench"

needs_data = pytest.mark.skipif(
    not DATA.is_dir(), reason=f"the real recordings are not beside the checkout ({DATA.name}/)"
)
needs_bench = pytest.mark.skipif(
    not BENCH.is_dir(), reason=f"the common benchmark workload is not beside the checkout ({BENCH.name}/)"
)


ENGINE_MODULE = {name: row.engine for name, row in OPTIONAL.items()}
"""Row of the table that needs an extra -> the module that it asks."""
ROWS = list(DETECTORS) + [
    pytest.param(name, marks=pytest.mark.skipif(find_spec(module) is None, reason=f"{module} is no part of `test`"))
    for name, module in ENGINE_MODULE.items()
]


def read_cases(path):
    """The arrays of a file by name."""
    with np.load(path, allow_pickle=False) as file:
        return SimpleNamespace(**{name: array[()] if array.ndim else array.item() for name, array in file.items()})
