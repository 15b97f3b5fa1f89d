"""What ran where: versions and machine, so that a figure can be told from another machine's."""

from __future__ import annotations

import os
import platform
import sys
from importlib.metadata import PackageNotFoundError, version
from typing import Final

PACKAGES: Final = ("vrlab-replay", "numpy", "scipy", "numba", "python-fcl", "trimesh", "mcap", "rerun-sdk", "pyarrow")
"""Packages whose version can change a verdict, a time or a file."""


def versions() -> dict[str, str]:
    """Versions of Python and of every package in ``PACKAGES`` that is installed."""
    found = {"python": platform.python_version()}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found


def machine() -> dict[str, str | int]:
    """Operating system, processor and how many cores there are; nothing that names a user or a host."""
    return {
        "system": platform.system(),
        "release": platform.release(),
        "processor": platform.machine(),
        "cores": os.cpu_count() or 1,
        "byte_order": sys.byteorder,
    }
