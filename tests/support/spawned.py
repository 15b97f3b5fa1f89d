"""Worker processes that a process has spawned."""

from contextlib import suppress

import psutil


def spawned_by(process=None):
    """Those that are alive below a process, by default this one."""
    found = []
    for child in (process or psutil.Process()).children(recursive=True):
        with suppress(psutil.Error):  # it ended meanwhile
            if "spawn_main" in " ".join(child.cmdline()):
                found.append(child)
    return found
