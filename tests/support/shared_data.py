"""Where the real recordings and meshes lie that tests use when present; the product never needs them."""

from pathlib import Path

import pytest

SHARED = Path(__file__).resolve().parents[3] / "shared"
DATA = SHARED / "data"

needs_data = pytest.mark.skipif(
    not DATA.is_dir(), reason=f"the real recordings are not beside the checkout ({DATA.name}/)"
)
