"""Reads a USD scene in a process of its own first: on a damaged binary layer the library may end its whole process.

Mutant 279 of a small .usdc did, and none of 1,500 mutants of its text (usd-core 26.11, 2026-11); a few bytes of a
binary layer may also ask for more memory than there is.
"""

import os
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Final

from sessions.errors import SceneSourceError
from sessions.scene_formats.safe_files import SceneFiles

MOST_SECONDS: Final = 300.0
MOST_MEMORY: Final = 12_000_000_000
"""Bytes of addresses; numpy and the library take 2 GB of them for the smallest scene."""


def try_scene(path: Path, root: Path) -> None:
    """Read a scene in another process, which may die.

    Raises ``SceneSourceError``: it died, or took too long; what it refuses is refused again by whoever reads it next.
    """
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    command = [sys.executable, "-m", "sessions.scene_formats.usd_trial", str(path), str(root)]
    try:
        ended = subprocess.run(command, env=environment, capture_output=True, check=False, timeout=MOST_SECONDS)
    except subprocess.TimeoutExpired:
        raise SceneSourceError(f"usd-core reads {path} for more than {MOST_SECONDS:.0f} s; reduce the scene") from None
    if ended.returncode:
        raise SceneSourceError(
            f"usd-core breaks down on {path}: it is damaged or needs too much memory; export it again"
        )


def main(path: str, root: str) -> None:
    """Read a scene as an import does, with bounded memory where the system can bound it."""
    from sessions.scene_formats.scene_source import Surface
    from sessions.scene_formats.usd_physics import read_usd_motion

    with suppress(ImportError):
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
    with suppress(SceneSourceError):
        read_usd_motion(Path(path), SceneFiles(Path(root)), Surface.AUTO, is_trial=True)


if __name__ == "__main__":
    main(*sys.argv[1:3])
