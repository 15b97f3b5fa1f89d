"""Where the real recordings and meshes lie that tests use when present; the product never needs them."""

from pathlib import Path

import pytest

SHARED = Path(__file__).resolve().parents[3] / "shared"
DATA = SHARED / "data"
BENCH = SHARED / "bench"

needs_data = pytest.mark.skipif(
    not DATA.is_dir(), reason=f"the real recordings are not beside the checkout ({DATA.name}/)"
)
needs_bench = pytest.mark.skipif(
    not BENCH.is_dir(), reason=f"the common benchmark workload is not beside the checkout ({BENCH.name}/)"
)
