"""Names that stand in a printed command for a recording or a run folder."""

from typing import Final

SESSION: Final = "SESSION"
"""Stands in a command for the recording that was replayed."""

RECORDING: Final = "FILE.mcap"
"""Stands in a command for the recording where its name is not printed, since files may be called after people."""

RUN: Final = "RUN"
"""Stands in a command for the folder of the run."""


def in_run_folder(command: str, folder: str = ".") -> str:
    """Return a command as it is typed in the folder of a run, where no path of a machine is named."""
    return command.replace(RUN, folder).replace(SESSION, "session.mcap")
