"""The sessions that a verb was given: files, and folders of them."""

from collections.abc import Iterable
from pathlib import Path

import click


def session_files(given: Iterable[Path]) -> list[Path]:
    """The files given, and those in folders given; a folder without any is a wrong use."""
    from replay.api.remote_files import reaching

    files: list[Path] = []
    for path in given:
        with reaching(path):
            found = sorted(path.glob("*.mcap")) if path.is_dir() else [path]
        if not found:
            raise click.UsageError(f"{path} holds no session files (*.mcap); name a file or another folder")
        files += found
    return files
