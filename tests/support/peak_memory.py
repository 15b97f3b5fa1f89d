"""The most memory a process held; for programs that tests start, which find this file with ``PYTHONPATH``.

Linux hands ``ru_maxrss`` of whoever started a program down to it, so a small program under a large test runner looks
large; ``VmHWM`` begins anew.
"""

import os
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parents[1]


def environment() -> dict[str, str]:
    """Variables of a program that is to find this file and the project."""
    paths = [str(HERE.parent), str(HERE), *os.environ.get("PYTHONPATH", "").split(os.pathsep)]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in paths if path)}


def peak_bytes() -> int:
    """Most bytes this process held at once."""
    status = Path("/proc/self/status")
    if status.is_file():
        line = next(line for line in status.read_text().splitlines() if line.startswith("VmHWM"))
        return int(line.split()[1]) * 1024
    if sys.platform == "win32":
        import psutil

        return int(psutil.Process().memory_info().peak_wset)
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
