"""Versions, machine and memory of a run: figures of different machines must not be mixed up."""

import ctypes
import os
import platform
import subprocess
import sys
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Final

VERSIONED_PACKAGES: Final = (
    "vrlab-replay",
    "numpy",
    "scipy",
    "numba",
    "python-fcl",
    "trimesh",
    "mcap",
    "rerun-sdk",
    "pyarrow",
)
"""Packages whose version can change a verdict, a time or a file."""

LINUX_PROCESSOR_FILE: Final = Path("/proc/cpuinfo")
MACOS_PROCESSOR_COMMAND: Final = ("/usr/sbin/sysctl", "-n", "machdep.cpu.brand_string")


def versions() -> dict[str, str]:
    """Versions of Python and of every package in ``VERSIONED_PACKAGES`` that is installed."""
    versions_of = {"python": platform.python_version()} | {name: _version(name) for name in VERSIONED_PACKAGES}
    return {name: number for name, number in versions_of.items() if number is not None}


@cache
def _version(package: str) -> str | None:
    """Read once: it parses the package's whole description, and a batch asks for each of its sessions."""
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def machine() -> dict[str, str | int]:
    """Operating system, processor and how many cores there are; nothing that names a user or a host."""
    return {
        "system": platform.system(),
        "release": platform.release(),
        "architecture": platform.machine(),
        "processor": processor_name(),
        "cores": os.cpu_count() or 1,
        "byte_order": sys.byteorder,
    }


def processor_name() -> str:
    """Name of the processor, ``AMD EPYC`` or ``Apple M2``; its architecture if it has no name."""
    read_name = {"Linux": _linux_processor_name, "Darwin": _of_macos}.get(platform.system(), platform.processor)
    return " ".join(read_name().split()) or platform.machine()


def _linux_processor_name() -> str:
    """The first processor in the kernel's list; on ARM the list names none."""
    if not LINUX_PROCESSOR_FILE.is_file():
        return ""
    cpuinfo_fields = (line.partition(":") for line in LINUX_PROCESSOR_FILE.read_text("utf-8", "replace").splitlines())
    return next((value for name, _, value in cpuinfo_fields if name.strip() == "model name"), "")


def _of_macos() -> str:
    try:
        return subprocess.run(MACOS_PROCESSOR_COMMAND, capture_output=True, text=True, timeout=5, check=False).stdout
    except (OSError, subprocess.TimeoutExpired):
        return ""


def give_back_memory() -> None:
    """Hand what was freed back to the system, where the C library is glibc, which keeps it.

    After two hours of twelve bodies were detected that was 0.1 GiB.
    """
    if platform.libc_ver()[0] == "glibc":
        ctypes.CDLL(None).malloc_trim(0)
