"""The sessions that a verb was given: files, folders of them, and text files that list them."""

from collections.abc import Iterable
from pathlib import Path

import click

LIST_SUFFIX = ".txt"
"""How the name of a text file ends that lists sessions, one a line."""


def session_files(paths: Iterable[Path]) -> list[Path]:
    """The files given, those in folders given, and those that lists name; one without any is a wrong use."""
    from replay.running.remote_files import store_errors

    files: list[Path] = []
    for path in paths:
        with store_errors(path):
            in_folder = sorted(path.glob("*.mcap")) if path.is_dir() else None
        if in_folder is not None:
            matching, expected_text = in_folder, "session files (*.mcap)"
        elif path.suffix == LIST_SUFFIX:
            matching, expected_text = sessions_of_list(path), "line with a session file"
        else:
            matching, expected_text = [path], ""
        if not matching:
            raise click.UsageError(f"{path} holds no {expected_text}; name a file or another folder")
        files += matching
    return files


def are_several(paths: Iterable[Path]) -> bool:
    """Whether a folder or a list was given: then each session gets its run folder in one, though it be the only one."""
    return any(path.is_dir() or path.suffix == LIST_SUFFIX for path in paths)


def sessions_of_list(path: Path) -> list[Path]:
    """The sessions that a text file names, one a line: paths from its folder on, or URLs; ``#`` begins a remark.

    Raises ``click.UsageError``: a line names no file, and it says which line.
    """
    from replay.running.remote_files import is_remote, path_of_place, store_errors
    from sessions.file_kinds import file_kind

    try:
        with store_errors(path):
            lines = path.read_text("utf-8").splitlines()
    except UnicodeDecodeError as error:
        kind = file_kind(path.read_bytes())
        reason = f"is {kind}" if kind else "is no text in UTF-8; list session files in it, one a line"
        raise click.UsageError(f"list {path} {reason}") from error
    if kind := file_kind("\n".join(lines).encode()):
        raise click.UsageError(f"list {path} is {kind}")
    name_of_line = {number: line.partition("#")[0].strip() for number, line in enumerate(lines, 1)}
    files = {
        number: path_of_place(name if "://" in name else path.parent / name)
        for number, name in name_of_line.items()
        if name
    }
    for number, file in files.items():
        if not is_remote(file) and not file.is_file():
            raise click.UsageError(f"{path}, line {number}: {file} is no file; mend the line or begin it with #")
    return [*files.values()]
